"""What an instrument's readings mean: holds, orders of rotations, points, clocks, load cells.

True values are worked out here by hand: matrices of rotations written out, wrenches by their
levers, means of creep in closed form.

Catches readings that are taken for what they are not, without a word.
"""

import json
import math
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import yaml
from sweeps import sweep

from spinepipe.imports.registry import read_settings
from spinepipe.problems import InputError
from spinepipe.testing_machine import folder as folders
from spinepipe.testing_machine.clocks import best_shift
from spinepipe.testing_machine.cycles import segment

SIDES = ("extension", "right_bending", "left_rotation")
SHIFTS = ("anterior", "superior", "right")

BASE = {
    "cohort": "rig",
    "title": "made up",
    "source": "no measurement",
    "vertebrae": ["L5", "L4"],
    "time": {"column": "t", "unit": "s"},
    "loads": [{"column": "M", "unit": "N m", "positive": "extension"}],
    "motion": [{"column": "angle", "unit": "deg", "joint": "L4L5", "positive": "extension"}],
    "steps": {"levels": [2.5, 5, 7.5]},
    "files": [{"file": "a.csv", "specimen": "s01", "test": "flexion"}],
}
ROTATIONS = [{"column": word, "unit": "deg", "joint": "L4L5", "positive": word} for word in SIDES]
TRANSLATIONS = [
    {"column": word, "unit": "mm", "joint": "L4L5", "positive": word} for word in SHIFTS
]


def table(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]
    path.write_text("\n".join(lines).replace("nan", "") + "\n")


def read(folder: Path, columns: dict[str, np.ndarray], **changes: object) -> folders.ImportedTests:
    table(folder / "a.csv", columns)
    path = folder / "rig.yaml"
    plain = json.loads(json.dumps({**BASE, **changes}))  # nothing shared, so no anchors
    path.write_text(yaml.safe_dump(plain))
    return folders.read(folder, read_settings(path))


def swings(cycles: int = 3, seconds: float = 40.0, hertz: float = 10.0) -> dict[str, np.ndarray]:
    """Time and moment: straight lines between +-8 N m."""
    time = np.arange(round(cycles * seconds * hertz) + 1) / hertz
    moment = 8.0 * np.interp(time / seconds % 1.0, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    return {"t": time, "M": moment}


def of(tests: folders.ImportedTests, column: str, cycle: int = 0) -> np.ndarray:
    (test,) = tests.tests
    return test.cycles[cycle].motion[:, [name for _, name in test.places].index(column)]


def said(tests: folders.ImportedTests) -> str:
    return "\n".join(folders._sentences(tests))


# --- holds ----------------------------------------------------------------------------------------


def test_a_turning_level_is_the_mean_over_its_hold(tmp_path: Path) -> None:
    """Creep of 0.5 deg with 8 s in holds of 30 s; noise puts the extreme of the load anywhere."""
    held, decay, hertz = 30.0, 8.0, 4.0
    sizes = np.array([0, 2.5, 5, 7.5, 5, 2.5, 0, -2.5, -5, -7.5, -5, -2.5] * 2 + [0])
    rows = round(held * hertz)
    within = np.arange(rows) / hertz
    moment, angle = (
        np.repeat(sizes, rows),
        np.concatenate(
            [size * (0.6 + 0.5 / 7.5 * (1 - np.exp(-within / decay))) for size in sizes]
        ),
    )
    noise = np.random.default_rng(3).normal(0.0, 0.02, len(moment))
    columns = {"t": np.arange(len(moment)) / hertz, "M": moment + noise, "angle": angle}
    tests = read(tmp_path, columns)
    mean = 7.5 * 0.6 + 0.5 * (1 - decay / held * (1 - math.exp(-held / decay)))
    for cycle in (0, 1):
        peaks = of(tests, "extension_deg", cycle)[[3, 9]]
        np.testing.assert_allclose(peaks, [mean, -mean], atol=0.01)
    time = tests.tests[0].cycles[0].time
    assert time is not None
    assert time[3] == pytest.approx(3 * held, abs=2.0)  # from the middle of one to that of another


@sweep("held", [1.5, 10.0])
def test_a_hold_after_a_slow_ramp_is_found(held: float) -> None:
    """Its median is the turn, not the extreme of its noise, and both ways have all of it."""
    corners = np.cumsum([0.0, 5.0, held, 10.0, held, 5.0])
    time = np.arange(0.0, corners[-1], 0.05)
    load = np.interp(time, corners, [0, 7.5, 7.5, -7.5, -7.5, 0])
    load += np.random.default_rng(1).normal(0.0, 0.03, len(load))
    (cycle,) = segment(load, 0.2, 0).cycles
    assert [branch.held for branch in cycle.branches] == [True, True, False]
    np.testing.assert_allclose(cycle.peaks, [7.5, -7.5], atol=0.025)
    out, across, _ = cycle.branches
    assert (out.last - across.first) * 0.05 == pytest.approx(held, abs=0.4)


@sweep("shape", [lambda x: 2 / np.pi * np.arcsin(np.sin(x)), np.sin])
def test_a_load_that_turns_at_once_is_no_hold(shape: object) -> None:
    load = 10.0 * shape(np.linspace(0.0, 4 * np.pi, 2001))  # type: ignore[operator]
    noise = np.random.default_rng(0).normal(0.0, 0.03, 2001)
    for cycle in segment(load + noise, 0.2, 0).cycles:
        assert not any(branch.held for branch in cycle.branches)
        assert cycle.peaks[0] == pytest.approx(10.0, abs=0.15)


def test_a_cycle_that_begins_beyond_its_reference_is_left_out(tmp_path: Path) -> None:
    columns = {name: values[20:] for name, values in swings().items()}
    tests = read(tmp_path, {**columns, "angle": columns["M"] / 1.5})
    assert len(tests.tests[0].cycles) == 2
    assert "Cycle 1 is left out: the recording begins after it has left the reference" in said(
        tests
    )


def through(*turns: float) -> np.ndarray:
    """A load that goes from turn to turn, 40 rows each."""
    return np.interp(np.arange(40 * (len(turns) - 1) + 1) / 40, np.arange(len(turns)), turns)


def test_a_ramp_to_a_preload_is_no_cycle() -> None:
    found = segment(through(0, -300, -800, -300, -800, -300, -800, -300, 0), 0.2, 0)
    assert (found.reference, found.way, found.both_sides) == (-300, -1, False)
    assert len(found.kept) == 3


def test_the_reference_that_would_keep_a_cycle_is_named() -> None:
    load = through(0, 7.5, 0.5, 7.5, 0.5, 7.5, 0.5)
    found = segment(load, 0.2, 0)
    assert [number for number, _ in found.left_out] == [2, 3]
    assert "`steps.reference: 0.5`" in found.left_out[0][1]
    assert len(segment(load, 0.2, 0, 0.5).kept) == 3


@sweep("swings", [(0, 1.2, -1.2), (0, 1.2, 0)])
def test_small_swings_before_the_first_cycle_are_not_of_it(swings: tuple[float, ...]) -> None:
    (cycle,) = segment(through(*swings, 7.5, -7.5, 0), 0.2, 0).cycles
    assert 56 < cycle.branches[0].first <= 80


def test_a_repeat_that_does_not_reach_the_first_ones_reference_is_refused(tmp_path: Path) -> None:
    files = [{**BASE["files"][0], "file": f"{name}.csv"} for name in "ba"]
    time = np.arange(161.0)
    load = through(2.5, 8, 2.5, 8, 2.5)
    table(tmp_path / "b.csv", {"t": time, "M": load, "angle": load})
    load = through(1, 8, 1, 8, 1)
    found = read(tmp_path, {"t": time, "M": load, "angle": load}, files=files, steps={})
    assert found.tests[0].levels[0] == 2.5
    with pytest.raises(InputError, match=r"b.csv.*begin at 2.5.*pass 1, .*steps.reference"):
        read(tmp_path, {"t": time, "M": load, "angle": load}, files=files[::-1], steps={})


@sweep(
    "load, motion, says",
    [
        (1.0, -1.0, r"L4L5 extension_deg: found -0.6\d*"),
        (1.0, 57.3, r"L4L5 extension_deg: found 38.\d*"),
        (1000.0, 1.0, r"mz_nm: found a range of 1.6e\+04 where 16 is usual"),
    ],
)
def test_a_repeat_of_another_sign_or_unit_is_refused(
    tmp_path: Path, load: float, motion: float, says: str
) -> None:
    files = [{**BASE["files"][0], "file": f"{name}.csv"} for name in "ab"]
    columns = {**swings(), "angle": swings()["M"] / 1.5}
    table(
        tmp_path / "b.csv", columns | {"M": load * columns["M"], "angle": motion * columns["angle"]}
    )
    with pytest.raises(InputError, match=says):
        read(tmp_path, columns, files=files)


def test_a_load_that_idles_does_not_drive(tmp_path: Path) -> None:
    columns = {**swings(), "angle": swings()["M"], "idle": 0.1 * swings()["M"]}
    loads = [*BASE["loads"], {"column": "idle", "unit": "N m", "positive": "right_bending"}]
    files = [{**BASE["files"][0], "driving": "idle"}]
    with pytest.raises(InputError, match=r"a.csv, driving: found mx_nm with .* 1.6, and mz_nm"):
        read(tmp_path, columns, files=files, loads=loads)


def test_one_way_is_not_there_and_back(tmp_path: Path) -> None:
    there = {name: values[:101] for name, values in swings().items()}
    assert "to 7.5 N m, one way." in said(read(tmp_path, {**there, "angle": there["M"]}))
    back = {name: values[:151] for name, values in swings().items()}
    assert "not all the way back" in said(read(tmp_path, {**back, "angle": back["M"]}))


# --- rotations and translations -------------------------------------------------------------------


def matrix(axis: str, degrees: np.ndarray) -> np.ndarray:
    """(N, 3, 3) rotations about an axis, written out."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    one, none = np.ones_like(c), np.zeros_like(c)
    rows = {
        "x": [[one, none, none], [none, c, -s], [none, s, c]],
        "y": [[c, none, s], [none, one, none], [-s, none, c]],
        "z": [[c, -s, none], [s, c, none], [none, none, one]],
    }
    return np.array(rows[axis]).transpose(2, 0, 1)


def ours(turned: np.ndarray) -> np.ndarray:
    """(3, N) of R = Rz(e) Rx(b) Ry(l): R01 = -sin e cos b, R21 = sin b, R20 = -cos b sin l."""
    bend = np.arcsin(turned[:, 2, 1])
    extension = -np.arcsin(turned[:, 0, 1] / np.cos(bend))
    left = -np.arcsin(turned[:, 2, 0] / np.cos(bend))
    return np.degrees([extension, bend, left])


def angles(moment: np.ndarray) -> dict[str, np.ndarray]:
    """About x, y, z."""
    return {"x": 0.9 * moment, "y": -1.2 * moment, "z": 1.6 * moment}


def told(given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return dict(zip(SIDES, (given["z"], given["x"], given["y"]), strict=True))


@sweep("order", ["".join(one) for one in permutations("xyz")])
@sweep("axes", ["body", "space"])
def test_rotations_in_another_order(tmp_path: Path, order: str, axes: str) -> None:
    """In the body R = R1 R2 R3, in space R = R3 R2 R1."""
    moment = swings()["M"]
    given = angles(moment)
    parts = [matrix(axis, given[axis]) for axis in (order if axes == "body" else order[::-1])]
    truth = ours(parts[0] @ parts[1] @ parts[2])
    tests = read(
        tmp_path,
        {**swings(), **told(given)},
        motion=ROTATIONS,
        rotations={"order": order, "axes": axes},
    )
    peak = np.searchsorted(moment[:101], 7.5)
    found = [of(tests, f"{word}_deg")[3] for word in SIDES]
    np.testing.assert_allclose(found, truth[:, peak], atol=0.05)
    assert "are converted to those of z, x', y''" in said(tests)


def test_rotation_vectors(tmp_path: Path) -> None:
    """Rodrigues: R = 1 + sin a K + (1 - cos a) K^2."""
    given = angles(swings()["M"])
    vector = np.radians(np.column_stack([given[axis] for axis in "xyz"]))
    size = np.linalg.norm(vector, axis=1)[:, None, None] + 1e-30
    x, y, z = (vector / size[:, :, 0]).T
    none = np.zeros_like(x)
    k = np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)
    truth = ours(np.eye(3) + np.sin(size) * k + (1 - np.cos(size)) * (k @ k))
    tests = read(
        tmp_path, {**swings(), **told(given)}, motion=ROTATIONS, rotations={"order": "helical"}
    )
    found = [of(tests, f"{word}_deg")[3] for word in SIDES]
    np.testing.assert_allclose(
        found, truth[:, np.searchsorted(swings()["M"][:101], 7.5)], atol=0.05
    )


def test_rotations_count_from_the_pose_of_the_first_row(tmp_path: Path) -> None:
    moment = swings()["M"]
    given, start = angles(moment), {"x": 6.0, "y": -9.0, "z": 12.0}
    turned = matrix("x", given["x"]) @ matrix("y", given["y"]) @ matrix("z", given["z"])
    first = np.eye(3)
    for axis in "xyz":
        first = first @ matrix(axis, np.array([start[axis]]))[0]
    # angles of x, y', z'' of R R0: R02 = sin y, R12 = -sin x cos y, R01 = -cos y sin z
    whole = turned @ first
    y = np.arcsin(whole[:, 0, 2])
    x, z = -np.arcsin(whole[:, 1, 2] / np.cos(y)), -np.arcsin(whole[:, 0, 1] / np.cos(y))
    columns = {**swings(), **told(dict(zip("xyz", np.degrees([x, y, z]), strict=True)))}
    tests = read(tmp_path, columns, motion=ROTATIONS, rotations={"order": "xyz"})
    found = [of(tests, f"{word}_deg")[3] for word in SIDES]
    peak = np.searchsorted(moment[:101], 7.5)
    np.testing.assert_allclose(found, ours(turned)[:, peak], atol=0.05)
    assert "from the pose of the first row" in said(tests)


def test_three_rotations_without_an_order_are_told(tmp_path: Path) -> None:
    given = angles(swings()["M"])
    tests = read(tmp_path, {**swings(), **told(given)}, motion=ROTATIONS)
    assert "Rotations of L4L5 are taken as those of z, x', y''" in said(tests)


def test_translations_are_told_to_be_those_of_the_origin(tmp_path: Path) -> None:
    moment = swings()["M"]
    columns = {**swings(), **dict.fromkeys((*SIDES, *SHIFTS), 0.1 * moment)}
    tests = read(tmp_path, columns, motion=[*ROTATIONS, *TRANSLATIONS])
    assert "Translations of L4L5 are taken as those of the joint's origin" in said(tests)


# --- two clocks -----------------------------------------------------------------------------------

SHIFT = 2.37


def two_files(folder: Path, cycles: float, gap: int = 0) -> dict[str, np.ndarray]:
    """A camera at 20 Hz that begins first, and the loads that it saw at 50 Hz."""
    rng = np.random.default_rng(4)

    def moment(time: np.ndarray) -> np.ndarray:
        return 8.0 * np.interp((time - 3.0) / 20.0 % 1.0, [0, 0.25, 0.75, 1], [0, 1, -1, 0])

    seen = np.arange(0.0, 3.0 + 20.0 * cycles, 0.05)
    angle = moment(seen) / 1.5 + rng.normal(0.0, 0.03, len(seen))
    angle[300 : 300 + gap] = np.nan
    pulse = (np.abs(seen - 5.0) < 0.12).astype(float)
    table(folder / "a_seen.csv", {"frame": seen / 0.05, "angle": angle, "sync": pulse})
    read_at = np.arange(0.0, 20.0 * cycles - 1.0, 0.02)
    return {
        "t": read_at,
        "M": moment(read_at + SHIFT) + rng.normal(0.0, 0.01, len(read_at)),
        "trigger": (np.abs(read_at + SHIFT - 5.0) < 0.12).astype(float),
    }


CAMERA = {"rate_hz": 20, "form": {"empty_cells": "left_out"}}


@sweep("how", ["told", "found", "signal"])
def test_a_camera_has_a_clock_of_its_own(tmp_path: Path, how: str) -> None:
    columns = two_files(tmp_path, 4, gap=6)
    file = {**BASE["files"][0], "motion_file": "{stem}_seen.csv"}
    if how == "told":
        file["shift_s"] = SHIFT
    sync = {"sync": {"load": "trigger", "motion": "sync"}} if how == "signal" else {}
    tests = read(tmp_path, columns, files=[file], motion_files={**CAMERA, **sync})
    for cycle in (0, 1, 2):
        levels = np.array(tests.tests[0].levels)
        # a clock that is off by 0.05 s opens the loop by 0.05 s times 1.07 deg/s
        found = of(tests, "extension_deg", cycle)
        steps = len(found)
        np.testing.assert_allclose(found, levels[:steps] / 1.5, atol=0.05)
    text = said(tests)
    assert "6 rows with an empty cell left out" in text
    assert f"a_seen.csv begins {SHIFT:.2f}" in text or how == "signal"
    assert "a_seen.csv is put on the rows of a.csv" in text


def test_a_shift_that_is_doubtful_is_refused(tmp_path: Path) -> None:
    """Twenty equal cycles: a shift by one of them is nearly as good."""
    columns = two_files(tmp_path, 20)
    file = {**BASE["files"][0], "motion_file": "a_seen.csv"}
    with pytest.raises(InputError, match="add `shift_s` to the file"):
        read(tmp_path, columns, files=[file], motion_files=CAMERA)


@sweep(
    "shift, positive, says",
    [
        (-SHIFT, "extension", "about 2.3[^,]*, the told one with its sign turned"),
        (4 * SHIFT, "extension", "about 2.3[^,]*: there rates"),
        (SHIFT, "flexion", "look at `positive`"),
        (None, "flexion", "look at `positive`"),
    ],
)
def test_a_shift_or_a_direction_that_the_rates_contradict_is_refused(
    tmp_path: Path, shift: float | None, positive: str, says: str
) -> None:
    columns = two_files(tmp_path, 8 if positive == "flexion" and shift else 4)
    file = {**BASE["files"][0], "motion_file": "a_seen.csv", "shift_s": shift}
    motion = [{**BASE["motion"][0], "positive": positive}]
    with pytest.raises(InputError, match=says) as caught:
        read(tmp_path, columns, files=[file], motion=motion, motion_files=CAMERA)
    assert ("add `shift_s`" in str(caught.value)) == (shift is None)


@sweep("shift", [-3.21, 0.0, 7.654])
def test_the_best_shift_is_that_of_the_signals(shift: float) -> None:
    seen, read_at = np.arange(0.0, 60.0, 0.05), np.arange(0.0, 50.0, 0.02)

    def bump(time: np.ndarray) -> np.ndarray:
        return np.exp(-(((time - 25.0) / 6.0) ** 2)) + np.exp(-(((time - 33.0) / 3.0) ** 2))

    found = best_shift(read_at, bump(read_at + shift), seen, -bump(seen), True)
    assert found.seconds == pytest.approx(shift, abs=0.01)
    assert found.likeness > 0.99
    assert found.next_best < 0.9


def test_clusters_of_markers_turn_joints(tmp_path: Path) -> None:
    """Both vertebrae turn; what the joint turns is the upper one against the lower one."""
    time = np.arange(0.0, 60.0, 0.1)
    moment = 8.0 * np.interp(time / 20.0 % 1.0, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    given = angles(moment)
    lower = matrix("y", 0.4 * moment) @ matrix("x", 0.2 * moment)
    joint = matrix("z", given["z"]) @ matrix("x", given["x"]) @ matrix("y", given["y"])
    columns = {"t": time}
    for vertebra, turned in (("a", lower), ("b", lower @ joint)):
        for number, place in enumerate([[30, 0, 0], [-20, 5, 25], [-20, 0, -25]]):
            seen = turned @ np.array(place, dtype=float) + 0.3 * moment[:, None]
            # the camera looks from the front: its x goes to the right, its z backwards
            columns |= {
                f"{vertebra}{number}_X": seen[:, 2],
                f"{vertebra}{number}_Y": seen[:, 1],
                f"{vertebra}{number}_Z": -seen[:, 0],
            }
    table(tmp_path / "seen.csv", {name.lower(): values for name, values in columns.items()})
    markers = {
        "clusters": {"L5": ["a0", "a1", "a2"], "L4": ["b0", "b1", "b2"]},
        "columns": "{marker}_{axis}",
        "axes": ["right", "superior", "posterior"],
    }
    changes = {
        "motion": [],
        "files": [{**BASE["files"][0], "motion_file": "seen.csv", "shift_s": 0.0}],
        "motion_files": {"time": {"column": "t", "unit": "s"}, "markers": markers},
    }
    tests = read(tmp_path, {"t": time, "M": moment}, **changes)
    found = [of(tests, f"{word}_deg")[3] for word in SIDES]
    np.testing.assert_allclose(found, [1.6 * 7.5, 0.9 * 7.5, -1.2 * 7.5], atol=0.02)
    # one that is frozen all the time, and one that is lost from row 400 on
    for since, line in ((0, r"\d+"), (400, "402")):
        given = {name: values.copy() for name, values in columns.items()}
        for axis in "XYZ":
            given[f"b1_{axis}"][since:] = 0.0 if since else given[f"b1_{axis}"][0]
        table(tmp_path / "seen.csv", {name.lower(): values for name, values in given.items()})
        with pytest.raises(
            InputError, match=f"seen.csv, line {line}: found markers of L4.*b1 most"
        ):
            read(tmp_path, {"t": time, "M": moment}, **changes)


# --- loads and what the instrument is worth -------------------------------------------------------

WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")
CELL = [
    {"column": name, "unit": "N" if name[0] == "f" else "N m", "positive": word}
    for name, word in zip(
        WRENCH, (*SHIFTS, "right_bending", "left_rotation", "extension"), strict=True
    )
]


def test_a_load_cell_below_reads_the_reaction_about_its_own_centre(tmp_path: Path) -> None:
    """Forces at p and a moment; the cell at c answers, after 2 s at rest.

    Its x goes to the left, its z forwards. About c the moment is M + (p - c) x F, written out.
    """
    swing = swings()
    rest = np.zeros(30)
    moment = np.concatenate([rest, swing["M"]])
    time = np.arange(len(moment)) / 10.0
    fx, fy, fz = 2.0 * moment, -50.0 * np.abs(moment) / 8.0, 1.0 * moment
    lever = np.array([10.0, 40.0, -5.0]) / 1000.0 - np.array([0.0, -60.0, 3.0]) / 1000.0
    mx = lever[1] * fz - lever[2] * fy
    my = lever[2] * fx - lever[0] * fz
    mz = moment + lever[0] * fy - lever[1] * fx
    values = [fz, -fy, -fx, mz, -my, -mx]
    ways = ("left", "superior", "anterior", "flexion", "left_rotation", "right_bending")
    idle = [3.0, -20.0, 1.0, 0.2, -0.1, 0.4]
    columns = {name: v + at for name, v, at in zip(WRENCH, values, idle, strict=True)}
    tests = read(
        tmp_path,
        {"t": time, **columns, "angle": moment / 1.5},
        loads=[{**one, "positive": way} for one, way in zip(CELL, ways, strict=True)],
        load_point_mm=[10, 40, -5],
        load_cell={"reads": "reaction", "point_mm": [0, -60, 3], "tare_s": 2},
        files=[{**BASE["files"][0], "driving": "mx"}],
    )
    loads = tests.tests[0].cycles[0].loads[3]
    np.testing.assert_allclose(loads, [15, -46.875, 7.5, 0, 0, 7.5], atol=0.3)
    assert abs(loads[3:5]).max() < 0.01
    text = said(tests)
    assert "a reaction: all signs are turned" in text
    assert "about the load point in the neutral pose" in text


def test_the_point_of_the_load_may_differ_between_files(tmp_path: Path) -> None:
    columns = {**swings(), "angle": swings()["M"] / 1.5}
    table(tmp_path / "b.csv", columns)
    files = [
        {**BASE["files"][0]},
        {"file": "b.csv", "specimen": "s02", "test": "flexion", "load_point_mm": [1, 2, 3]},
    ]
    rows = folders._loads(read(tmp_path, columns, files=files, load_point_mm=[0, 30, 0]))
    assert {(row[0], *row[11:14]) for row in rows} == {
        ("s01", 0.0, 30.0, 0.0),
        ("s02", 1.0, 2.0, 3.0),
    }


def test_the_accuracy_goes_on_to_the_cohort(tmp_path: Path) -> None:
    columns = {**swings(), "angle": swings()["M"] / 1.5}
    accuracy = {"rotation_deg": 0.2, "extension_deg": 1e-9}
    tests = read(tmp_path, columns, accuracy=accuracy)
    assert folders._header(tests)["accuracy"] == accuracy
    assert "accuracy" not in folders._header(read(tmp_path, columns))


SEEN = {**BASE["files"][0], "motion_file": "b.csv"}
MARKERS = {"clusters": {"L4": ["a", "b", "c"]}}


@sweep(
    "changes, says",
    [
        ({"rotations": {"order": "xyz"}}, "1 of the three rotations of L4L5; allowed: all three"),
        ({"rotations": {"order": "zxz"}}, "rotations.order: found 'zxz'"),
        ({"load_cell": {"reads": "action", "point_mm": [0, 0, 0]}}, "no column for fx_n, fy_n"),
        ({"time": None, "load_cell": {"reads": "action", "tare_s": 1}}, "add `time:`, or delete"),
        ({"files": [SEEN]}, "files.0.motion_file: found a file, and no `motion_files`"),
        ({"motion_files": {"rate_hz": 2}}, "files.0.motion_file: found nothing"),
        ({"motion_files": {}, "files": [SEEN]}, "found neither; allowed: one of time and rate_hz"),
        ({"files": [{**SEEN, "shift_s": 1}]}, "one way to compare their clocks"),
        ({"motion_files": {"markers": MARKERS}, "files": [SEEN]}, "found columns and markers"),
        (
            {"motion_files": {"markers": MARKERS}, "motion": [], "rotations": {"order": "xyz"}},
            "rotations: found columns and markers",
        ),
        (
            {"motion_files": {"markers": {**MARKERS, "axes": ["right", "left", "superior"]}}},
            "found right, left, superior: an axis twice",
        ),
        (
            {"motion_files": {"markers": {**MARKERS, "axes": ["anterior", "superior", "left"]}}},
            "or a left-handed frame",
        ),
        ({"files": [*BASE["files"], {**BASE["files"][0], "test": "b"}]}, "a.csv once more"),
        ({"motion_files": {"markers": {"clusters": {}}}}, "L4 wrong or missing"),
        ({"motion_files": {"rate_hz": 9}, "time": None, "files": [SEEN]}, "the column of time of"),
        ({"accuracy": {"flexion_deg": 1.0}}, "accuracy"),
    ],
)
def test_faults_have_a_place_and_a_remedy(
    tmp_path: Path, changes: dict[str, object], says: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, {**swings(), "angle": swings()["M"]}, **changes)
    assert says in str(caught.value)
