"""Results do not say where, on which machine and by whom they were made.

Every project that tests build in one run of theirs is looked through as soon as it is there
(`small_project`); here stands that the look sees what it is for.

Catches names of machines, people or folders in results.
"""

import base64
import gzip
import re
import zipfile
import zlib
from io import BytesIO
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from drawn import a_picture
from matplotlib.figure import Figure
from sweeps import sweep
from whereabouts import needles, told_of_the_machine

from spinepipe.jobs.digest import versions

ROOT = Path(__file__).resolve().parents[2]
ASKING = re.compile(
    r"platform\.(node|uname|platform|version)|gethostname|getfqdn|getuser|getlogin|os\.uname"
    r"|expanduser|Path\.home|pwd\.|environ\b.*(USER|HOME|LOGNAME)"
)


def in_zip(word: str) -> bytes:
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a", word)
    return content.getvalue()


def in_table(word: str, metadata: bool) -> bytes:
    content = pa.BufferOutputStream()
    rows = pa.table({"a": ["x" if metadata else word] * 2000})
    rows = rows.replace_schema_metadata({"made": word if metadata else "x"})
    pq.write_table(rows, content, compression="zstd")
    return content.getvalue().to_pybytes()


def in_picture(word: str) -> bytes:
    content = BytesIO()
    Figure(figsize=(1, 1)).savefig(content, format="png")
    whole = content.getvalue()
    chunk = b"zTXtwhere\0\0" + zlib.compress(word.encode())
    size = (len(chunk) - 4).to_bytes(4)
    end = whole.rindex(b"IEND") - 4
    return whole[:end] + size + chunk + zlib.crc32(chunk).to_bytes(4) + whole[end:]


HIDING = {
    "a.txt": lambda word: word.encode(),
    "a.parquet": lambda word: in_table(word, metadata=False),
    "b.parquet": lambda word: in_table(word, metadata=True),
    "a.png": in_picture,
    "a.gz": lambda word: gzip.compress(word.encode()),
    "a.zip": in_zip,
    "a.html": lambda word: b'<img src="data:;base64,' + base64.b64encode(in_picture(word)) + b'">',
}


@sweep("name", HIDING)
def test_what_a_file_hides_is_seen(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "results" / "small"
    folder.mkdir(parents=True)
    for word in needles(tmp_path):
        (folder / name).write_bytes(HIDING[name](f"made in {word.decode()}"))
        assert f"small/{name}: {word.decode()}" in told_of_the_machine(tmp_path)
    (folder / name).write_bytes(HIDING[name]("made in a study"))
    assert told_of_the_machine(tmp_path) == []


def test_only_temporary_files_and_notes_of_runs_are_called_by_the_machine() -> None:
    """And no other file asks for machine, user or home. Notes lie in Snakemake's record."""
    asking = {
        path.relative_to(ROOT).as_posix()
        for folder in ("spinepipe", "workflow")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".smk") and ASKING.search(path.read_text(encoding="utf-8"))
    }
    assert asking == {"spinepipe/files.py"}


@sweep("kind", ["svg", "png", "pdf"])
def test_pictures_say_what_drew_them_and_no_more(kind: str, tmp_path: Path) -> None:
    content = a_picture(kind)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / f"a.{kind}").write_bytes(content)
    assert told_of_the_machine(tmp_path) == []


def test_versions_are_numbers() -> None:
    assert all(re.fullmatch(r"[0-9a-z.+]+", version) for version in versions().values())
