"""`.trc` as laboratories have them: any separator, rate and rounding of times; stale counts.

Catches a good file that is refused, and one that breaks off and is read.
"""

from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from spinepipe.motion.reading import read_motion
from spinepipe.problems import InputError

MANY = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")
PER_M = {"mm": 1e3, "cm": 1e2, "m": 1.0, "meters": 1.0, "Millimeters": 1e3}

names = st.lists(st.text("ABCXYZ.12*", min_size=1, max_size=5), min_size=1, max_size=4, unique=True)


def lines_of(
    places: np.ndarray,
    labels: list[str],
    *,
    rate: float = 100.0,
    decimals: int = 3,
    units: str = "mm",
    sign: str = "\t",
    between: str | None = None,
    values: str | None = None,
    told: int | None = None,
) -> list[str]:
    """A file by hand: a sign between cells, others between names and between values."""
    count = len(places) if told is None else told
    header = map(str, (rate, rate, count, len(labels), units))
    rows = (
        sign.join(
            [str(k + 1), f"{k / rate:.{decimals}f}", *(f"{one:.4f}" for one in place.ravel())]
        )
        for k, place in enumerate(places)
    )
    return [
        sign.join(("PathFileType", "4", "(X/Y/Z)", "m.trc")),
        sign.join(KEYS),
        (values or sign).join(header),
        sign.join(("Frame#", "Time", (between or sign * 3).join(labels))),
        sign.join(
            ("", "", *chain.from_iterable((f"X{k}", f"Y{k}", f"Z{k}") for k in range(len(labels))))
        ),
        *rows,
    ]


def write(folder: Path, lines: list[str], end: str = "\n") -> Path:
    path = folder / "m.trc"
    path.write_text("\n".join(lines) + end)
    return path


def drawn(frames: int, markers: int) -> np.ndarray:
    return np.random.default_rng(frames).uniform(-900.0, 900.0, (frames, markers, 3)).round(4)


@MANY
@given(
    names,
    st.integers(2, 12),
    st.floats(10.0, 400.0).map(lambda one: round(one, 2)),
    st.integers(3, 6),
    st.sampled_from(sorted(PER_M)),
    st.sampled_from(["\t", ",", ";", "   "]),
    st.sampled_from([None, " ", "\t", "\t\t"]),
)
def test_what_was_written_is_read(
    tmp_path: Path,
    labels: list[str],
    frames: int,
    rate: float,
    decimals: int,
    units: str,
    sign: str,
    between: str | None,
) -> None:
    places = drawn(frames, len(labels))
    kind = {"rate": rate, "decimals": decimals, "units": units, "sign": sign}
    lines = lines_of(places, labels, between=between if sign == "\t" else None, **kind)
    found = read_motion(write(tmp_path, lines))
    assert found.names == tuple(labels)
    np.testing.assert_allclose(PER_M[units] * found.places, places, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(
        found.time_s, np.arange(frames) / rate, atol=0.5001 * 10.0**-decimals
    )


@MANY
@given(st.floats(10.0, 400.0), st.floats(1.03, 3.0), st.booleans())
def test_another_rate_is_refused_however_times_are_rounded(
    tmp_path: Path, rate: float, factor: float, slower: bool
) -> None:
    """Over 200 frames, three decimals hide less than 2 % of the duration."""
    lines = lines_of(drawn(200, 1), ["T1"], rate=rate)
    lines[2] = lines[2].replace(str(rate), str(rate / factor if slower else rate * factor))
    with pytest.raises(InputError, match="frames a second, and times"):
        read_motion(write(tmp_path, lines))


@pytest.mark.parametrize("values", ["\t\t", " \t\t  ", "\t\t\t"])
def test_several_tabs_between_values_are_one(tmp_path: Path, values: str) -> None:
    places = drawn(5, 2)
    found = read_motion(write(tmp_path, lines_of(places, ["T1", "L3"], values=values)))
    np.testing.assert_allclose(1e3 * found.places, places, atol=1e-9)


@pytest.mark.parametrize(("told", "there"), [(9, 6), (4, 6)])
def test_a_stale_number_of_frames_is_told(tmp_path: Path, told: int, there: int) -> None:
    """With a line end at the end, or all decimals."""
    for end in ("\n", ""):
        found = read_motion(
            write(tmp_path, lines_of(drawn(there, 2), ["T1", "L3"], told=told), end)
        )
        assert len(found.time_s) == there
        assert found.repaired == (f"NumFrames says {told} frames, {there} are there and were read",)


@pytest.mark.parametrize("told", [9, 6])
@pytest.mark.parametrize("lost", [2, 9, 20])
def test_a_file_that_breaks_off_within_a_row_is_refused(
    tmp_path: Path, lost: int, told: int
) -> None:
    lines = lines_of(drawn(6, 2), ["T1", "L3"], told=told)
    with pytest.raises(InputError, match="the last of them not whole"):
        read_motion(write(tmp_path, [*lines[:-1], lines[-1][:-lost]], ""))


def test_numbers_without_a_name_are_kept_apart(tmp_path: Path) -> None:
    """Columns that NumMarkers counts have a number for a name; what follows them is left out."""
    places = drawn(5, 4)
    lines = lines_of(places, ["T1", "", "L3", ""])
    found = read_motion(write(tmp_path, lines))
    assert found.names == ("T1", "unnamed#1", "L3", "unnamed#2")
    np.testing.assert_allclose(1e3 * found.places, places, atol=1e-9)
    lines = lines_of(places, ["T1", "L3"])
    lines[7] = "\t".join(lines[7].split("\t")[:-3])
    found = read_motion(write(tmp_path, lines))
    np.testing.assert_allclose(1e3 * found.places, places[:, :2], atol=1e-9)
    assert found.repaired == ("points without a name behind the markers are left out",)


@pytest.mark.parametrize("counted", [2, 3])
def test_names_go_by_place_where_a_point_between_them_has_none(
    tmp_path: Path, counted: int
) -> None:
    places = drawn(5, 3)
    lines = lines_of(places, ["T1", "", "L3"])
    lines[2] = lines[2].replace("\t3\t", f"\t{counted}\t")
    found = read_motion(write(tmp_path, lines))
    assert found.names == ("T1", "unnamed#1", "L3")
    np.testing.assert_allclose(1e3 * found.places, places, atol=1e-9)
    assert len(found.repaired) == 1


@pytest.mark.parametrize("labels", [["Left Knee", "RK"], ["Left Knee"]])
def test_a_blank_within_a_name_parts_no_names(tmp_path: Path, labels: list[str]) -> None:
    count = len(labels)
    lines = lines_of(drawn(5, count), labels)
    lines[2] = lines[2].replace(f"\t{count}\t", f"\t{count + 1}\t")
    with pytest.raises(InputError, match=f"{count} names"):
        read_motion(write(tmp_path, lines))


def test_the_last_line_may_have_no_end_where_nothing_is_lost(tmp_path: Path) -> None:
    """Numbers without noughts behind them do not tell whether the last one is whole."""
    lines = lines_of(np.round(drawn(5, 2)), ["T1", "L3"])
    lines = [line.replace(".0000", "") for line in lines]
    assert "may be cut off" in read_motion(write(tmp_path, lines, "")).repaired[0]
    assert not read_motion(write(tmp_path, lines)).repaired


@pytest.mark.parametrize(("rate", "decimals"), [(120.0, 2), (240.0, 2), (100.0, 1)])
def test_times_too_coarse_for_frames_are_from_the_rate(
    tmp_path: Path, rate: float, decimals: int
) -> None:
    lines = lines_of(drawn(50, 1), ["T1"], rate=rate, decimals=decimals)
    found = read_motion(write(tmp_path, lines))
    np.testing.assert_allclose(found.time_s, np.arange(50) / rate)
    assert "too few decimals" in found.repaired[0]
    del lines[20:40]
    with pytest.raises(InputError, match="times that grow"):
        read_motion(write(tmp_path, lines))


def test_a_cell_that_is_no_number_is_found_in_rows_of_any_length(tmp_path: Path) -> None:
    lines = lines_of(drawn(9, 2), ["T1", "L3"])
    lines[6], lines[10] = lines[6] + "\t\t", lines[10].replace("\t", "\tx", 6)
    with pytest.raises(InputError) as caught:
        read_motion(write(tmp_path, lines))
    (problem,) = caught.value.problems
    assert (problem.row, problem.column, problem.found[:2]) == (11, "Time", "'x")


@pytest.mark.parametrize(("sign", "decimal"), [(",", "."), (";", ","), (";", "."), ("\t", ".")])
def test_a_table_of_markers_may_have_the_spreadsheet_s_signs(
    tmp_path: Path, sign: str, decimal: str
) -> None:
    """A comma is a decimal sign where semicolons part cells, and nowhere else."""
    places = drawn(5, 1)
    rows = [
        sign.join([f"{0.02 * k:.2f}", *(f"{one:.4f}" for one in place.ravel())]).replace(
            ".", decimal
        )
        for k, place in enumerate(places)
    ]
    path = tmp_path / "m.csv"
    path.write_text("\n".join([sign.join(["time_s", *(f"T1_{a}_mm" for a in "xyz")]), *rows]))
    np.testing.assert_allclose(1e3 * read_motion(path).places, places, atol=1e-9)
