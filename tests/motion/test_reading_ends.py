"""Files of motion at the ends of what is read: size, crops, axes, names, first frames, labels."""

import struct
from pathlib import Path

import numpy as np
import pytest
from c3d_of_ezc3d import write_c3d

from spinepipe.motion import reading, reading_text
from spinepipe.motion.reading import axes_of, read_motion
from spinepipe.motion.recording import recording_from
from spinepipe.problems import InputError, InputProblem

HEADER = "time_s,T1_x_mm,T1_y_mm,T1_z_mm"


def csv(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder / "m.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def frames(folder: Path) -> Path:
    """Five frames, 20 ms apart."""
    return csv(folder, *(f"{0.02 * k:.2f},{k},2,3" for k in range(1, 6)))


def problem_of(path: Path, **asked: object) -> InputProblem:
    with pytest.raises(InputError) as caught:
        read_motion(path, **asked)  # type: ignore[arg-type]
    (problem,) = caught.value.problems
    return problem


def test_a_file_is_read_up_to_its_most_bytes(tmp_path: Path, monkeypatch) -> None:
    path = frames(tmp_path)
    size = path.stat().st_size
    monkeypatch.setattr(reading, "MOST_RECORDING_BYTES", size)
    assert len(read_motion(path).time_s) == 5
    monkeypatch.setattr(reading, "MOST_RECORDING_BYTES", size - 1)
    assert problem_of(path).remedy == "crop it"


def test_more_than_a_hundred_megabytes_are_the_most(tmp_path: Path) -> None:
    """The file is all hole: nothing of it is read."""
    path = tmp_path / "m.trc"
    with path.open("wb") as file:
        file.truncate(250_000_000)
    problem = problem_of(path)
    assert (problem.found, problem.allowed) == ("250 MB", "at most 128 MB")


def test_a_file_is_read_up_to_its_most_cells(tmp_path: Path, monkeypatch) -> None:
    """Eighteen commas, three a line, count as cells; six minutes of 80 markers are fewer."""
    assert reading_text.MOST_CELLS > 6 * 60 * 100 * (2 + 80 * 3)
    path = frames(tmp_path)
    monkeypatch.setattr(reading_text, "MOST_CELLS", 18)
    assert len(read_motion(path).time_s) == 5
    monkeypatch.setattr(reading_text, "MOST_CELLS", 17)
    problem = problem_of(path)
    assert (problem.found, problem.allowed) == ("18 cells", "at most 17 cells")


def test_a_control_character_is_told_at_its_line(tmp_path: Path) -> None:
    problem = problem_of(csv(tmp_path, "0,1,2,3", "1,1,\x072,3"))
    assert (problem.row, problem.found) == (3, "the control character U+0007")


@pytest.mark.parametrize(
    ("start_s", "end_s", "kept"),
    [
        (0.04, 0.08, [2, 3, 4]),
        (0.04 + 5e-7, 0.08 - 5e-7, [2, 3, 4]),  # rounded times
        (0.04 + 3e-6, 0.08 - 3e-6, [3]),
        (float("nan"), 0.04, [1, 2]),
        (0.08, float("nan"), [4, 5]),
        (None, None, [1, 2, 3, 4, 5]),
    ],
)
def test_both_ends_of_a_crop_are_kept(
    tmp_path: Path, start_s: float | None, end_s: float | None, kept: list[int]
) -> None:
    found = read_motion(frames(tmp_path), start_s=start_s, end_s=end_s)
    np.testing.assert_allclose(1e3 * found.places[:, 0, 0], kept)
    np.testing.assert_allclose(found.time_s, 0.02 * np.array(kept))
    assert found.first == kept[0]


def test_a_crop_with_nothing_in_it_tells_what_there_is(tmp_path: Path) -> None:
    problem = problem_of(frames(tmp_path), start_s=0.05, end_s=0.055, file="a/b.csv")
    assert problem.file == "a/b.csv"
    assert problem.found == "no frame from 0.05 s to 0.055 s"
    assert problem.allowed == "times from 0.02 to 0.1 s"
    assert problem_of(frames(tmp_path), end_s=0.01).found == "no frame from an end to 0.01 s"
    nan = float("nan")
    assert problem_of(frames(tmp_path), start_s=1.0, end_s=nan).found.endswith("to an end")


def test_signs_of_axes_may_be_written_both_ways() -> None:
    np.testing.assert_array_equal(axes_of("+x +y z"), np.eye(3))
    np.testing.assert_array_equal(axes_of("-y z -x"), [[0, -1, 0], [0, 0, 1], [-1, 0, 0]])
    for text in ("--x y z", "x y z z", "xx y z", "x z", "x x y", "a b c", ""):
        with pytest.raises(ValueError, match="once each"):
            axes_of(text)
    with pytest.raises(ValueError, match="left of right"):
        axes_of("x y -z")


def test_only_the_last_part_of_a_name_is_the_marker_s(tmp_path: Path) -> None:
    """A folder of subjects may stand before; a name that is all subject stays."""
    columns = [
        f"{name}_{axis}_mm" for name in ("Lab:Anna:T1", "Lab:Anna: T2", "Ben:") for axis in "xyz"
    ]
    found = read_motion(csv(tmp_path, "0" + ",1" * 9, header=",".join(["time_s", *columns])))
    assert found.names == ("T1", "T2", "Ben:")
    assert found.repaired == ("names of markers without what stands before the colon",)


def test_suffixes_may_be_written_large(tmp_path: Path) -> None:
    path = frames(tmp_path).rename(tmp_path / "M.CSV")
    assert len(read_motion(path).time_s) == 5


def test_a_marker_with_one_number_lost_is_not_seen() -> None:
    """Nor one at nought altogether; one nought is a place."""
    raw = np.array([[[1.0, np.nan, 2.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e-9], [1.0, 2.0, 3.0]]])
    found = recording_from(("a", "b", "c", "d"), np.zeros(1), raw)
    np.testing.assert_array_equal(found.seen, [[False, False, True, True]])
    assert not found.places[0, :2].any()
    np.testing.assert_array_equal(found.places[0, 2:], raw[0, 2:])


def counted_c3d(path: Path, count: int) -> Path:
    """Three frames of markers that are told apart by their x, mm."""
    places = np.ones((3, count, 3))
    places[..., 0] += np.arange(count)
    return write_c3d(path, places, [f"M{k}" for k in range(count)])


def test_more_markers_than_a_parameter_holds_keep_their_names(tmp_path: Path) -> None:
    """255 names stand in the first, the others in the next."""
    found = read_motion(counted_c3d(tmp_path / "m.c3d", 300))
    assert found.names == tuple(f"M{k}" for k in range(300))
    np.testing.assert_allclose(1e3 * found.places[0, :, 0], 1.0 + np.arange(300))


def test_a_c3d_begins_at_its_first_frame(tmp_path: Path) -> None:
    """Counted from nought by who wrote it, at 50 a second."""
    found = read_motion(counted_c3d(tmp_path / "m.c3d", 2))
    np.testing.assert_allclose(found.time_s, [0.0, 0.02, 0.04], atol=1e-12)


def test_a_c3d_without_a_rate_is_told(tmp_path: Path) -> None:
    path = counted_c3d(tmp_path / "m.c3d", 2)
    path.write_bytes(path.read_bytes().replace(struct.pack("<f", 50.0), bytes(4)))
    problem = problem_of(path)
    assert problem.column == "POINT:RATE"
    assert problem.found == "0 frames a second"


def trc(folder: Path, frames: list[str], told: int) -> Path:
    path = folder / "m.trc"
    lines = ["PathFileType\t4\t(X/Y/Z)\tm.trc", "DataRate\tNumFrames\tNumMarkers\tUnits"]
    lines += [f"50\t{told}\t1\tmm", "Frame#\tTime\tT1\t\t", "\t\tX1\tY1\tZ1", *frames]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_trc_of_nothing_but_a_header_is_cut_short(tmp_path: Path) -> None:
    """Also where it says so; one frame is enough."""
    problem = problem_of(trc(tmp_path, [""], 0))
    assert (problem.row, problem.column, problem.found) == (3, "NumFrames", "0 frames")
    assert problem_of(trc(tmp_path, [], 0)).found == "no header of a .trc"
    one = read_motion(trc(tmp_path, ["1\t0.5\t1\t2\t3"], 1))
    assert (one.time_s.tolist(), one.names) == ([0.5], ("T1",))


def test_times_that_fall_are_told_with_both(tmp_path: Path) -> None:
    rows = ["1\t0.1\t1\t2\t3", "2\t0.3\t1\t2\t3", "3\t0.2\t1\t2\t3"]
    problem = problem_of(trc(tmp_path, rows, 3))
    assert (problem.row, problem.found) == (8, "0.2 s after 0.3 s")
