"""Tables of OpenSim (`.sto`, `.mot`) read as OpenSim writes them, and as older programs did."""

from pathlib import Path

import numpy as np
import opensim
import pytest

from spinepipe.motion.reading_storage import read_storage
from spinepipe.problems import InputError

HEADER = ["Coordinates", "version=1", "nRows=2", "nColumns=3", "inDegrees=yes", "endheader"]
ROWS = ["time\ta\tb", "0\t1\t2", "0.5\t3\t4"]


def write(folder: Path, lines: list[str]) -> Path:
    path = folder / "m.sto"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_table_that_opensim_writes_is_read_back(tmp_path: Path) -> None:
    values = np.random.default_rng(2).normal(size=(4, 2))
    table = opensim.TimeSeriesTable()
    table.setColumnLabels(["ground_force_vx", "ground_force_px"])
    for k, row in enumerate(values.tolist()):
        table.appendRow(k / 50.0, opensim.RowVector(row))
    table.addTableMetaDataString("inDegrees", "no")
    opensim.STOFileAdapter().write(table, str(tmp_path / "o.sto"))
    found = read_storage(tmp_path / "o.sto")
    assert (found.names, found.in_degrees, found.repaired) == (
        ("ground_force_vx", "ground_force_px"),
        *(False, ()),
    )
    np.testing.assert_allclose(found.values, values, rtol=1e-12)
    np.testing.assert_allclose(found.time_s, np.arange(4) / 50.0, atol=1e-12)


def test_headers_of_older_programs_are_read(tmp_path: Path) -> None:
    """Keys and values between blanks, free text, blank lines, blanks between cells."""
    old = [
        "name m.mot",
        "datacolumns 3",
        "datarows 2",
        "range 0 0.5",
        "",
        "made by hand",
        "endheader",
    ]
    found = read_storage(write(tmp_path, [*old, "", *(row.replace("\t", "   ") for row in ROWS)]))
    assert (found.names, found.in_degrees, found.repaired) == (("a", "b"), None, ())
    np.testing.assert_array_equal(found.values, [[1.0, 2.0], [3.0, 4.0]])


def test_letters_of_the_header_s_end_and_indented_rows_do_not_matter(tmp_path: Path) -> None:
    """Nor does the word in free text."""
    head = ["my endheaders", *HEADER[:-1], "EndHeader\t\t"]
    found = read_storage(write(tmp_path, [*head, *(f"\t{row}" for row in ROWS)]))
    assert found.names == ("a", "b")
    np.testing.assert_array_equal(found.values, [[1.0, 2.0], [3.0, 4.0]])


def test_what_is_read_otherwise_is_told(tmp_path: Path) -> None:
    lines = [one.replace("nRows=2", "nRows=9") for one in HEADER]
    found = read_storage(write(tmp_path, [*lines, "time\ta\ta", *ROWS[1:]]))
    assert (found.names, found.in_degrees) == (("a#1", "a#2"), True)
    assert found.repaired[1] == "the header says 9 rows, 2 are there and were read"


@pytest.mark.parametrize(
    ("lines", "row", "column", "says"),
    [
        (ROWS, 1, None, "no header"),
        ([*HEADER, "a\tb", "0\t1"], 7, None, "'a'"),
        ([*HEADER, *ROWS[:2], "0.5\t3"], 9, None, "2 cells"),
        ([*HEADER, *ROWS[:2], "0.5\t3\tx"], 9, "b", "'x'"),
        ([*HEADER, *ROWS[:2], "-1\t3\t4"], 9, "time", "-1 s after 0 s"),
        (["DataType=Vec3", *HEADER, *ROWS[:2], "0.5\t3\t4,5,6"], 10, "b", "'4,5,6'"),
    ],
)
def test_what_cannot_be_read_is_named(
    tmp_path: Path, lines: list[str], row: int | None, column: str | None, says: str
) -> None:
    with pytest.raises(InputError) as caught:
        read_storage(write(tmp_path, lines))
    (problem,) = caught.value.problems
    assert (problem.row, problem.column) == (row, column)
    assert problem.found.startswith(says)
