"""No result file is believed that is not, to the bit, what was written; leftovers are swept.

Catches a result believed that was damaged, and leftovers that stay.
"""

import json
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from drawn import a_picture

from spinepipe.files import appearing, sweep
from spinepipe.marks import (
    CONTENT,
    KEY,
    DamagedFile,
    read_json,
    read_mark,
    with_mark,
    write_marked,
)
from spinepipe.motion.export import mot
from spinepipe.schema import Column, Table
from spinepipe.tables import opened, read, read_metadata, to_arrow, write

DIGEST = "0123456789abcdef" * 4
TABLE = Table(
    "small", "A table.", ("n",), (Column("n", "integer", "n"), Column("x", "number", "x"))
)


def table(path: Path, rows: int = 5) -> Path:
    """A file of these rows; x is the square of n."""
    write(to_arrow(TABLE, {"n": range(rows), "x": np.arange(rows) ** 2.0}), path, {KEY: DIGEST})
    return path


@pytest.fixture(params=[5, 2000], ids=["small", "packed"])
def parquet(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A file of few rows, written plainly, and one of many, compressed."""
    return table(tmp_path / "rows.parquet", request.param)


def test_every_flipped_bit_of_a_table_is_seen(parquet: Path) -> None:
    """One bit of each byte, which one changes from byte to byte."""
    whole = parquet.read_bytes()
    for place in range(0, len(whole), 1 if len(whole) < 3000 else 13):
        flipped = bytes([whole[place] ^ (1 << place % 8)])
        parquet.write_bytes(whole[:place] + flipped + whole[place + 1 :])
        assert read_mark(parquet) == ""
        with pytest.raises(DamagedFile):
            read(parquet)


def test_a_table_cut_off_anywhere_or_prolonged_is_seen(parquet: Path) -> None:
    whole = parquet.read_bytes()
    for length in (0, 1, 4, 8, 11, len(whole) // 2, len(whole) - 9, len(whole) - 1):
        for content in (whole[:length], whole[:length] + bytes(len(whole) - length)):
            parquet.write_bytes(content)
            assert read_mark(parquet) == ""
            with pytest.raises(DamagedFile) as caught:
                read(parquet)
            assert str(parquet) in str(caught.value)
            assert "computed anew" in str(caught.value)
            assert "\n" not in str(caught.value)
    parquet.write_bytes(whole + b"\0")
    assert read_mark(parquet) == ""


def test_the_digest_is_of_all_other_bytes(parquet: Path) -> None:
    whole = parquet.read_bytes()
    told = pq.read_metadata(parquet).metadata[CONTENT.encode()]
    assert whole.count(told) == 1
    assert sha256(whole.replace(told, b"")).hexdigest().encode() == told


def test_pages_have_checksums_that_any_reader_can_verify(parquet: Path) -> None:
    """The last byte of the first column's last page is changed; pyarrow alone looks."""
    column = pq.read_metadata(parquet).row_group(0).column(0)
    first = column.dictionary_page_offset or column.data_page_offset
    last = first + column.total_compressed_size - 1
    whole = parquet.read_bytes()
    parquet.write_bytes(whole[:last] + bytes([whole[last] ^ 4]) + whole[last + 1 :])
    with pytest.raises(OSError, match="CRC"):
        pq.ParquetFile(parquet, page_checksum_verification=True).read()


def test_a_table_with_other_numbers_under_the_same_metadata_is_not_believed(parquet: Path) -> None:
    """As a person would write it who changes a number by pyarrow."""
    rows = pq.read_table(parquet)
    other = rows.set_column(1, "x", [np.arange(rows.num_rows) ** 3.0])
    pq.write_table(other.replace_schema_metadata(rows.schema.metadata), parquet)
    assert read_mark(parquet) == ""
    with pytest.raises(DamagedFile, match="not those that were written"):
        read(parquet)


def test_whole_tables_are_read_as_before(parquet: Path) -> None:
    assert read_mark(parquet) == DIGEST
    assert read(parquet, ["x"]).column_names == ["x"]
    assert read(parquet)["x"][3].as_py() == 9.0
    assert read_metadata(parquet) == {KEY: DIGEST}
    with opened(parquet) as file:
        assert sum(part.num_rows for part in file.iter_batches(2)) == file.metadata.num_rows
    first = parquet.read_bytes()
    write(read(parquet), parquet, read_metadata(parquet))
    assert parquet.read_bytes() == first


def test_a_table_of_somebody_else_is_read(tmp_path: Path) -> None:
    pq.write_table(to_arrow(TABLE, {"n": [1], "x": [2.0]}), tmp_path / "own.parquet")
    assert read(tmp_path / "own.parquet")["x"].to_pylist() == [2.0]
    assert read_mark(tmp_path / "own.parquet") == ""


def test_no_table_is_an_error_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "none.parquet")


def test_one_changed_word_of_any_other_file_is_seen(tmp_path: Path) -> None:
    contents = {
        "a.svg": a_picture("svg"),
        "a.png": a_picture("png"),
        "a.html": "<html><body>12.3 N/m</body></html>",
        "a.yaml": "stiffness: 12.3\n",
        "a.csv": "x\n12.3\n",
        "a.osim": "<a>12.3</a>\n",
        "a.mot": mot("m", np.zeros(3), np.zeros((3, 18, 6))),
    }
    for name, content in contents.items():
        path = tmp_path / name
        write_marked(content, path, DIGEST)
        whole = path.read_bytes()
        assert read_mark(path) == DIGEST
        for place in {0, 5, len(content) // 2, len(content) - 3, len(whole) - 3}:
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
            assert read_mark(path) == "", (name, place)


def test_one_changed_number_of_a_json_file_is_seen_its_layout_is_free(tmp_path: Path) -> None:
    path, data = tmp_path / "a.json", {"s01": [{"cost": 0.1, "name": "bést"}], "n": float("nan")}
    for indent in (None, 1):
        path.write_text(json.dumps(with_mark(data, DIGEST), indent=indent))
        assert read_mark(path) == DIGEST
        assert read_json(path)["s01"] == data["s01"]
    for old, new in (
        ("0.1", "0.2"),
        ("s01", "s02"),
        (DIGEST, DIGEST[::-1]),
        ("}", ""),
        ("n", "\0"),
    ):
        path.write_text(json.dumps(with_mark(data, DIGEST)).replace(old, new))
        assert read_mark(path) == ""
        with pytest.raises(DamagedFile):
            read_json(path)
    path.write_text("[1, 2]")
    assert read_json(path) == [1, 2]
    assert read_mark(path) == ""


def dead() -> int:
    """The number of a process that has ended and was waited for."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_what_dead_processes_left_is_swept_and_what_lives_stays(tmp_path: Path) -> None:
    folder = tmp_path / "jobs" / "pose=0001"
    with appearing(folder / "stiffness=a.parquet") as mine:
        ended = dead()
        swept = {
            mine.name.replace(f".{os.getpid()}@", f".{ended}@"),
            f".stiffness=b.parquet.{ended}",
            ".best.json.99999999999999999999",
            ".old.parquet.1@of-another-machine",
        }
        stays = {
            mine.name,
            f".stiffness=b.parquet.{os.getpid()}",
            ".new.parquet.1@of-another-machine",
            ".stiffness=b.parquet",
            f"stiffness=b.parquet.{ended}",
            f".notes.{ended}.txt",
            ".hidden",
        }
        for name in swept | stays:
            (folder / name).write_bytes(b"PAR1")
        os.utime(folder / ".old.parquet.1@of-another-machine", (0, 0))
        assert sweep(tmp_path) == len(swept)
        assert {path.name for path in folder.iterdir()} == stays
    assert (folder / "stiffness=a.parquet").read_bytes() == b"PAR1"


def test_nothing_behind_a_link_is_swept(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / f".a.parquet.{dead()}").write_bytes(b"")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "jobs").symlink_to(tmp_path / "elsewhere")
    assert sweep(tmp_path / "results") == 0


def test_a_file_that_is_being_written_is_in_no_data_set(tmp_path: Path) -> None:
    table(tmp_path / "pose=0001" / "stiffness=a.parquet")
    with appearing(tmp_path / "pose=0001" / "stiffness=b.parquet") as half:
        half.write_bytes(b"PAR1")
        found = ds.dataset(tmp_path, format="parquet", partitioning="hive")
        assert [Path(name).name for name in found.files] == ["stiffness=a.parquet"]
        assert found.count_rows() == 5
