"""Files of motion read as those who write them mean it: OpenSim's and ezc3d's own, and by hand."""

from pathlib import Path

import numpy as np
import opensim
import pytest
from c3d_of_ezc3d import RATE, write_c3d

from spinepipe.effects.contract import Array
from spinepipe.motion.reading import read_motion
from spinepipe.motion.recording import MarkerRecording
from spinepipe.problems import InputError, InputProblem

NAMES = ("LPSI", "RPSI", "T1")
ORIGINAL = ("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames")
HELD_MM = 5e-4
"""Half of the last digit that is written by hand here."""


def places_mm(frames: int = 5) -> Array:
    """(F, 3, 3) mm of three markers, drawn."""
    return np.random.default_rng(7).uniform(-500.0, 500.0, (frames, len(NAMES), 3))


def trc(places: Array, *, units: str = "mm", rate: float = RATE, blank: str = "\t") -> list[str]:
    """Lines of a `.trc` as a laboratory writes it; NaN is an empty cell."""
    count, frames = places.shape[1], len(places)
    lines = [
        blank.join(("PathFileType", "4", "(X/Y/Z)", "m.trc")),
        blank.join((*("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"), *ORIGINAL)),
        blank.join(map(str, (rate, rate, frames, count, units, rate, 1, frames))),
        blank.join(("Frame#", "Time", *((blank * 3).join(NAMES[:count]).split(blank)))),
        blank.join(f"{axis}{k + 1}" for k in range(count) for axis in "XYZ"),
        "",
    ]
    for k, frame in enumerate(places):
        cells = ["" if np.isnan(value) else f"{value:.3f}" for value in frame.ravel()]
        lines.append(blank.join([str(k + 1), f"{k / RATE:.4f}", *cells]))
    return lines


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def problem_of(path: Path, axes: str = "x y z", start_s: float | None = None) -> InputProblem:
    """The one thing that is wrong with a file."""
    with pytest.raises(InputError) as caught:
        read_motion(path, axes, start_s)
    (problem,) = caught.value.problems
    return problem


def assert_same(found: MarkerRecording, wanted_mm: Array, within_mm: float = HELD_MM) -> None:
    assert found.names == NAMES
    assert found.seen.all()
    np.testing.assert_allclose(1e3 * found.places, wanted_mm, rtol=0.0, atol=within_mm)


def test_a_trc_that_opensim_writes_is_read_back(tmp_path: Path) -> None:
    wanted = places_mm()
    table = opensim.TimeSeriesTableVec3()
    table.setColumnLabels(NAMES)
    for k, frame in enumerate(wanted):
        row = opensim.RowVectorVec3([opensim.Vec3(*point) for point in frame.tolist()])
        table.appendRow(k / RATE, row)
    table.addTableMetaDataString("DataRate", f"{RATE:g}")
    table.addTableMetaDataString("Units", "mm")
    opensim.TRCFileAdapter().write(table, str(tmp_path / "o.trc"))
    found = read_motion(tmp_path / "o.trc")
    assert_same(found, wanted)
    np.testing.assert_allclose(found.time_s, np.arange(5) / RATE, atol=1e-12)


def test_opensim_reads_the_same_numbers_from_a_trc(tmp_path: Path) -> None:
    path = write(tmp_path / "m.trc", trc(places_mm()))
    table = opensim.TimeSeriesTableVec3(str(path))
    theirs = [
        [
            [point[i] for i in range(3)]
            for point in map(table.getRowAtIndex(k).getElt, [0] * 3, range(3))
        ]
        for k in range(table.getNumRows())
    ]
    found = read_motion(path)
    np.testing.assert_allclose(1e3 * found.places, theirs, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.time_s, table.getIndependentColumn(), atol=1e-12)


def test_a_c3d_that_ezc3d_writes_is_read_back(tmp_path: Path) -> None:
    """It holds single precision."""
    found = read_motion(write_c3d(tmp_path / "m.c3d", places_mm(), NAMES))
    assert_same(found, places_mm(), 1e-4)
    np.testing.assert_allclose(np.diff(found.time_s), 1.0 / RATE, atol=1e-9)


def test_a_residual_of_minus_one_and_noughts_are_gaps(tmp_path: Path) -> None:
    places = places_mm()
    places[1, 2] = np.nan
    places[3, 0] = 0.0
    found = read_motion(write_c3d(tmp_path / "m.c3d", places, NAMES))
    assert {(int(f), int(k)) for f, k in np.argwhere(~found.seen)} == {(1, 2), (3, 0)}
    assert not found.places[~found.seen].any()


@pytest.mark.parametrize(("units", "per_mm"), [("mm", 1.0), ("cm", 0.1), ("m", 0.001)])
def test_units_of_the_file_count(tmp_path: Path, units: str, per_mm: float) -> None:
    in_units = per_mm * places_mm()
    within = 0.51e-3 / per_mm
    assert_same(
        read_motion(write(tmp_path / "m.trc", trc(in_units, units=units))), places_mm(), within
    )
    assert_same(
        read_motion(write_c3d(tmp_path / "m.c3d", in_units, NAMES, units)), places_mm(), 1e-4
    )
    header = ",".join(["time_s", *(f"{n}_{a}_{units}" for n in NAMES for a in "xyz")])
    rows = [
        ",".join(map(repr, [k / RATE, *frame]))
        for k, frame in enumerate(in_units.reshape(5, -1).tolist())
    ]
    assert_same(read_motion(write(tmp_path / "m.csv", [header, *rows])), places_mm(), 1e-9)


@pytest.mark.parametrize("blank", ["\t", "  ", " \t ", "\t\u00a0"])
def test_tabs_and_spaces_part_cells(tmp_path: Path, blank: str) -> None:
    assert_same(read_motion(write(tmp_path / "m.trc", trc(places_mm(), blank=blank))), places_mm())


def test_empty_cells_and_noughts_of_a_trc_are_gaps(tmp_path: Path) -> None:
    places = places_mm()
    places[0, 1], places[4, 2] = 0.0, np.nan
    found = read_motion(write(tmp_path / "m.trc", trc(places)))
    assert {(int(f), int(k)) for f, k in np.argwhere(~found.seen)} == {(0, 1), (4, 2)}


def test_an_empty_cell_between_spaces_cannot_be_told(tmp_path: Path) -> None:
    places = places_mm()
    places[2, 1] = np.nan
    problem = problem_of(write(tmp_path / "m.trc", trc(places, blank="  ")))
    assert (problem.row, problem.found) == (9, "8 cells in frame 3")


def test_a_cell_that_is_no_number_is_named_with_frame_and_marker(tmp_path: Path) -> None:
    lines = trc(places_mm())
    cells = lines[8].split("\t")
    cells[6] = "1,5"
    lines[8] = "\t".join(cells)
    problem = problem_of(write(tmp_path / "m.trc", lines))
    assert (problem.row, problem.column, problem.found) == (9, "RPSI", "'1,5'")


def test_times_come_from_the_rate_where_the_column_is_empty(tmp_path: Path) -> None:
    lines = trc(places_mm())
    for k in range(6, len(lines)):
        cells = lines[k].split("\t")
        lines[k] = "\t".join([cells[0], "", *cells[2:]])
    found = read_motion(write(tmp_path / "m.trc", lines))
    np.testing.assert_allclose(found.time_s, np.arange(5) / RATE)
    assert found.repaired == ("times are from DataRate, the column has none",)


def test_times_of_nought_alone_are_none(tmp_path: Path) -> None:
    """A column of noughts tells nothing; one frame at nought does."""
    lines = trc(places_mm())
    noughts = [cells.split("\t") for cells in lines[6:]]
    lines[6:] = ["\t".join([frame, "0", *cells]) for frame, _, *cells in noughts]
    found = read_motion(write(tmp_path / "m.trc", lines))
    np.testing.assert_allclose(found.time_s, np.arange(5) / RATE)
    one = read_motion(write(tmp_path / "one.trc", trc(places_mm(1))))
    assert (one.time_s.tolist(), one.repaired) == ([0.0], ())


def test_tabs_at_the_end_of_a_line_may_be_missing_or_too_many(tmp_path: Path) -> None:
    """Editors cut off what is empty; laboratories write a tab after each cell."""
    places = places_mm()
    places[2, 2], places[4, 1:] = np.nan, np.nan
    cut = [line.rstrip("\t") for line in trc(places)]
    longer = [*cut[:6], *(f"{line}\t\t" for line in trc(places)[6:])]
    for lines in (cut, longer):
        found = read_motion(write(tmp_path / "m.trc", lines))
        assert {(int(f), int(k)) for f, k in np.argwhere(~found.seen)} == {(2, 2), (4, 1), (4, 2)}
        gone = np.isnan(places)
        np.testing.assert_allclose(1e3 * found.places[~gone], places[~gone], atol=HELD_MM)


@pytest.mark.parametrize(
    ("line", "was", "becomes", "row", "column", "says"),
    [
        (1, "PathFileType", "Path", 1, None, "no header of a .trc"),
        (3, "50.0\t50.0", "\t50.0", 3, "DataRate", "nothing"),
        (3, "50.0\t50.0", "fast\t50.0", 3, "DataRate", "'fast'"),
        (3, "50.0\t50.0", "inf\t50.0", 3, "DataRate", "'inf'"),
        (3, "50.0\t50.0", "0\t50.0", 3, "DataRate", "0"),
        (3, "50.0\t50.0", "50.6\t50.0", 3, "DataRate", "50.6 frames a second, and times 0.02 s"),
        (3, "\t3\tmm", "\t0\tmm", 3, "NumMarkers", "0"),
        (3, "\t5\t3\t", "\t5\t4\t", 4, None, "3 names"),
        (3, "\tmm\t", "\tyard\t", 3, "Units", "'yard'"),
        (8, "0.0200", "", 8, "Time", "nothing"),
        (9, "0.0400", "0.0200", 9, "Time", "0.02 s after 0.02 s"),
        (9, "0.0400", "late", 9, "Time", "'late'"),
        (9, "3\t0.0400", "third\t0.0400", 9, "Frame#", "'third'"),
        (9, "3\t0.0400", "3\t0.0400\t1.0", 9, None, "12 cells in frame 3"),
    ],
)
def test_what_is_wrong_in_a_trc_is_named_at_its_line(
    tmp_path: Path, line: int, was: str, becomes: str, row: int, column: str | None, says: str
) -> None:
    lines = trc(places_mm())
    assert was in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(was, becomes, 1)
    problem = problem_of(write(tmp_path / "m.trc", lines))
    assert (problem.file, problem.row, problem.column) == ("m.trc", row, column)
    assert problem.found.startswith(says)


def test_a_rate_that_is_off_by_rounding_is_the_same(tmp_path: Path) -> None:
    """Up to one in a hundred."""
    found = read_motion(write(tmp_path / "m.trc", trc(places_mm(), rate=50.4)))
    np.testing.assert_allclose(found.time_s, np.arange(5) / RATE, atol=1e-12)


def test_a_laboratory_with_z_up_is_turned(tmp_path: Path) -> None:
    """Its x is forwards, y to the left, z up; a point 1 forwards, 2 left, 3 up."""
    places = np.tile([1.0, 2.0, 3.0], (2, 1, 1))
    found = read_motion(write(tmp_path / "m.trc", trc(places)), "x z -y")
    np.testing.assert_allclose(1e3 * found.places[0, 0], [1.0, 3.0, -2.0])


def test_subjects_are_cut_off_names_where_each_stays_one(tmp_path: Path) -> None:
    full = ("Anna:LPSI", "Anna:RPSI", "T1")
    found = read_motion(write_c3d(tmp_path / "m.c3d", places_mm(), full))
    assert found.names == NAMES
    assert found.repaired == ("names of markers without what stands before the colon",)
    two = ("Anna:T1", "Ben:T1", "Ben:LPSI")
    found = read_motion(write_c3d(tmp_path / "n.c3d", places_mm(), two))
    assert found.names == ("Anna:T1", "Ben:T1", "LPSI")


@pytest.mark.parametrize(
    ("names", "found", "repeated"),
    [
        (("T1", "T1", "L3"), ("T1#1", "T1#2", "L3"), ("T1",)),
        (("T1", "Ann:T1", "Ann:T1"), ("T1", "Ann:T1#1", "Ann:T1#2"), ("Ann:T1",)),
        (("T1", "", ""), ("T1", "unnamed#1", "unnamed#2"), ("",)),
        (("T1#1", "T1", "T1"), ("T1#1", "T1#2", "T1#3"), ("T1",)),
    ],
)
def test_markers_without_a_name_or_of_one_name_have_numbers(
    tmp_path: Path, names: tuple[str, ...], found: tuple[str, ...], repeated: tuple[str, ...]
) -> None:
    """Model outputs are called like markers where a file has room for four letters."""
    read = read_motion(write_c3d(tmp_path / "m.c3d", places_mm(), names))
    assert (read.names, read.repeated) == (found, repeated)
    assert read.repaired == (
        "names that are empty or stand more than once have a number, as in T1#2",
    )
    np.testing.assert_allclose(1e3 * read.places, places_mm(), atol=1e-4)


def test_what_is_no_file_of_motion_is_named(tmp_path: Path) -> None:
    assert problem_of(tmp_path / "no.trc").found == "no such file"
    assert problem_of(write(tmp_path / "m.txt", ["x"])).found == "a file '.txt'"
    assert problem_of(write(tmp_path / "m.c3d", ["x"])).allowed == "a .c3d"
    assert problem_of(write(tmp_path / "m.trc", ["x"])).row == 1


@pytest.mark.parametrize(
    ("header", "rows", "line", "column", "says"),
    [
        ("time,T1_x_mm,T1_y_mm,T1_z_mm", "0,1,2,3", 1, "time_s", "no such column"),
        ("time_s,T1_x_mm,T1_y_mm", "0,1,2", 1, "T1", "only x, y"),
        ("time_s,T1_x,T1_y_mm,T1_z_mm", "0,1,2,3", 1, "T1_x", "no marker"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_m", "0,1,2,3", 1, None, "columns in m, mm"),
        ("time_s,time_s,T1_x_m,T1_y_m,T1_z_m", "0,0,1,2,3", 1, None, "columns in m"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_mm", "0,1,2", 2, None, "3 cells"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_mm", "\n0,1,b,3", 3, "T1_y_mm", "'b'"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_mm", "0,1,inf,3", 2, "T1_y_mm", "'inf'"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_mm", "0,1,2,3\n\n0,1,2,3", 4, "time_s", "0 s after 0 s"),
        ("time_s,T1_x_mm,T1_y_mm,T1_z_mm", "", 1, None, "no frames"),
    ],
)
def test_a_csv_that_cannot_be_read_is_named(
    tmp_path: Path, header: str, rows: str, line: int, column: str | None, says: str
) -> None:
    problem = problem_of(write(tmp_path / "m.csv", [header, rows]))
    assert (problem.row, problem.column, problem.found) == (line, column, says)
