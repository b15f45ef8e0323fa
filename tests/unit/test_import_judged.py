"""`spinepipe import` judges before it writes: mistakes of the settings are told at their line.

The file is a straight line through zero of a known slope; each mistake is one key of the settings.
Catches a mistake that is written as a cohort, or told at the copy or at another key.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
import yaml
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cli import main
from spinepipe.testing_machine.recording import _resolution

DEG_PER_NM = 0.6
PEAK = 7.5

SIDES = ("s01", "s02")
LOADS = [
    {"column": "torque_a", "unit": "N m", "positive": "extension"},
    {"column": "torque_b", "unit": "N m", "positive": "right_bending"},
]
MOTION = [
    {"column": "a", "unit": "deg", "joint": "L4L5", "positive": "extension"},
    {"column": "b", "unit": "deg", "joint": "L4L5", "positive": "right_bending"},
]


def cycles(count: int = 3) -> np.ndarray:
    """(N,) N m, there and back to both sides, from zero."""
    turns = np.array([0.0, *[PEAK, -PEAK] * count, 0.0])
    ends = np.concatenate([np.linspace(a, b, 60)[:-1] for a, b in pairwise(turns)])
    return np.append(ends, 0.0)


def rig(folder: Path, *, names: dict[str, str] | None = None, **changes: Any) -> Path:
    """Settings of two specimens and two tests, with their files, columns renamed by ``names``."""
    rng = np.random.default_rng(7)
    moment = cycles()
    files = []
    for specimen in SIDES:
        for test, own in (("extension_flexion", 0), ("lateral_bending", 1)):
            loads = np.zeros((len(moment), 2))
            loads[:, own] = moment
            angles = DEG_PER_NM * loads + rng.normal(0.0, 0.01, loads.shape)
            head = ",".join((names or {}).get(n, n) for n in ("torque_a", "torque_b", "a", "b"))
            path = folder / f"{specimen}_{test}.csv"
            np.savetxt(path, np.hstack([loads, angles]), "%.4f", ",", header=head, comments="")
            driving = (changes.get("loads") or LOADS)[own]["column"]
            files.append(
                {"file": path.name, "specimen": specimen, "test": test, "driving": driving}
            )
    document = {
        "cohort": "rig",
        "title": "made up",
        "source": "no measurement",
        "vertebrae": ["L5", "L4"],
        "loads": LOADS,
        "motion": MOTION,
        "files": files,
        **changes,
    }
    path = folder / "rig.yaml"
    text = yaml.dump(document, Dumper=_Plain, sort_keys=False)
    path.write_text(text)
    return path


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, data: object) -> bool:
        return True


def run(folder: Path, path: Path, *options: str) -> int:
    return main(["--root", str(folder), "import", str(path), *options])


def changed(rows: list[dict[str, str]], **keys: str) -> list[dict[str, str]]:
    return [{**row, **keys} for row in rows]


def exchanged(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    first, second = (row["column"] for row in rows)
    return [{**rows[0], "column": second}, {**rows[1], "column": first}]


@sweep(
    "changes, key, suspected",
    [
        ({"motion": changed(MOTION, unit="rad")}, "motion.0.unit: found 'rad'", "suspected: deg"),
        ({"loads": changed(LOADS, unit="N mm")}, "loads.0.unit: found 'N mm'", "suspected: N m;"),
        (
            {"loads": changed(LOADS, unit="N cm")},
            "loads.0.unit",
            "suspected: N m; correct loads.0.unit",
        ),
        (
            {"motion": [{**MOTION[0], "positive": "flexion"}, MOTION[1]]},
            "motion.0.positive: found 'flexion'",
            "the sign of motion.0.positive, or of loads.0.positive",
        ),
        ({"motion": exchanged(MOTION)}, "motion.0.column: found 'b'", "motion.1.column exchanged"),
        (
            {
                "loads": [
                    {**one, "positive": LOADS[1 - n]["positive"]} for n, one in enumerate(LOADS)
                ]
            },
            "motion.0.column: found 'a'",
            "or loads.1.column and loads.0.column",
        ),
    ],
)
def test_a_wrong_key_is_told_at_its_line_and_nothing_is_written(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    changes: dict[str, Any],
    key: str,
    suspected: str,
) -> None:
    path = rig(tmp_path, **changes)
    assert run(tmp_path, path) == 1
    told = capsys.readouterr().err
    assert key in told
    assert suspected in told
    assert "acknowledged_warnings: [motion] in rig.yaml" in told or "above -90" in told
    assert not list((tmp_path / "config" / "cohorts").iterdir())
    line = next(n for n, text in enumerate(path.read_text().splitlines(), 1) if "motion:" in text)
    assert f"rig.yaml, line {line + 1}," in told or "motion.0.column" not in key


@sweep("unit, words", [("N m", "loads.0.unit: found 'N m'"), ("N mm", None)])
def test_moments_in_n_mm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: str, words: str | None
) -> None:
    path = rig(tmp_path)
    for file in tmp_path.glob("s*.csv"):
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        table[:, :2] *= 1e3
        np.savetxt(file, table, "%.4f", ",", header="torque_a,torque_b,a,b", comments="")
    path.write_text(path.read_text().replace("unit: N m\n", f"unit: {unit}\n"))
    assert run(tmp_path, path) == (1 if words else 0)
    told = capsys.readouterr().err
    assert words is None or (words in told and "N mm; correct loads.0.unit" in told)


def test_angles_in_radians(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = rig(tmp_path)
    for file in tmp_path.glob("s*.csv"):
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        table[:, 2:] *= np.pi / 180.0
        np.savetxt(file, table, "%.6f", ",", header="torque_a,torque_b,a,b", comments="")
    assert run(tmp_path, path) == 1
    told = capsys.readouterr().err
    assert "motion.0.unit: found 'deg'" in told
    assert "motion.1.unit: found 'deg'" in told
    assert "suspected: rad; correct motion.0.unit" in told
    meant = {"acknowledged_warnings": ["motion"], "accuracy": {"rotation_deg": 0.3}}
    path.write_text(path.read_text() + yaml.safe_dump(meant))
    assert run(tmp_path, path) == 0
    assert "warn  rig/motion.csv" in capsys.readouterr().out
    read = cohorts.read(tmp_path / "config" / "cohorts" / "rig")
    assert read.acknowledged_warnings == ("motion",)
    sd = read.reading_sd()
    assert sd is not None
    assert sd[3] == 0.3  # beside what the rows scatter by


def test_load_and_motion_exchanged_are_told_by_the_names_of_their_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """7.5 deg under 4.5 N m are as likely as 4.5 deg under 7.5 N m."""
    names = {"a": "angle_a", "b": "angle_b"}
    loads = [{**one, "column": f"angle_{'ab'[n]}"} for n, one in enumerate(LOADS)]
    motion = [{**one, "column": f"torque_{'ab'[n]}"} for n, one in enumerate(MOTION)]
    path = rig(tmp_path, names=names, loads=loads, motion=motion)
    assert run(tmp_path, path) == 1
    told = capsys.readouterr().err
    assert "loads.0.column: found 'angle_a' in loads" in told
    assert "motion.1.column: found 'torque_b' in motion" in told
    numbers = [{**one, "column": 3 + n} for n, one in enumerate(LOADS)]
    path = rig(tmp_path, names=names, loads=numbers, motion=[{**o, "column": 1 + n} for n, o in
               enumerate(MOTION)])  # fmt: skip
    assert run(tmp_path, path) == 0  # somebody who names columns by number means it


def test_a_folder_is_judged_as_it_would_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is edited by hand stays: the new specimen is not in it, and the old folder stands."""
    path = rig(tmp_path)
    assert run(tmp_path, path) == 0
    folder = tmp_path / "config" / "cohorts" / "rig"
    before = {one.name: one.read_bytes() for one in folder.iterdir()}
    path.write_text(path.read_text().replace("specimen: s02", "specimen: '002'"))
    assert run(tmp_path, path, "--replace") == 1
    told = capsys.readouterr().err
    for name in ("specimens.csv", "joints.csv"):
        assert f"rig/{name}, specimen: found no row of '002'" in told
    assert {one.name: one.read_bytes() for one in folder.iterdir()} == before
    assert [one.name for one in folder.parent.iterdir()] == ["rig"]
    for name in ("specimens.csv", "joints.csv"):
        text = (folder / name).read_text().replace("s02", "002")
        (folder / name).write_text(text)
    assert run(tmp_path, path, "--replace") == 0
    assert cohorts.read(folder).specimen_names == ("s01", "002")


def test_show_writes_no_cohort_and_shows_rows_with_units_and_directions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig(tmp_path, motion=[{**MOTION[0], "positive": "flexion"}, MOTION[1]])
    assert run(tmp_path, path, "--show") == 0
    told = capsys.readouterr().out
    rows = [line.split() for line in told.splitlines()]
    at = next(n for n, row in enumerate(rows) if row[:1] == ["line"])
    assert "mz_nm to extension" in told
    assert "L4L5 extension_deg" in told
    assert rows[at + 1][:2] == ["2", "0"]
    assert float(rows[at + 3][3]) == pytest.approx(-2 * DEG_PER_NM * PEAK / 59, abs=0.05)
    assert "motion.0.positive: found 'flexion'" in told
    assert not (tmp_path / "config").exists()
    (page,) = (tmp_path / "results" / "show").iterdir()
    assert str(page) in told


def test_show_of_a_file_that_nobody_foresaw_shows_its_first_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig(tmp_path, form={"delimiter": "tab"})
    (tmp_path / "s01_lateral_bending.csv").write_bytes(b"\x89\x00\x01")
    assert run(tmp_path, path) == 1
    assert f"--show {path}" in capsys.readouterr().out
    assert run(tmp_path, path, "--show") == 1
    told = capsys.readouterr().out
    assert "1  torque_a,torque_b,a,b" in told
    assert "no text" in told
    assert not (tmp_path / "config").exists()


def test_show_of_what_is_not_read_has_matches_cameras_and_workbooks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s01_a.csv").write_bytes("Zeit,Kraft\n0,1\n".encode("utf-16"))
    book = openpyxl.Workbook()
    book.active.append(["Marker", 1.5])
    book.create_sheet("Notes").append(["by hand"])
    book.save(tmp_path / "s01_a_seen.xlsx")
    files = [{"glob": "{specimen}_{test}.csv", "motion_file": "{stem}_seen.xlsx"}]
    assert run(tmp_path, rig(tmp_path, files=files, motion_files={"rate_hz": 20}), "--show") == 1
    told = capsys.readouterr().out
    assert "s01_a.csv, as it stands:\n    1  Zeit,Kraft\n" in told
    for line in ("       sheet Sheet", "    1  Marker → 1.5", "       sheet Notes"):
        assert f"{line}\n" in told


def test_of_two_specimens_with_keys_of_their_own_the_wrong_ones_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig(tmp_path)
    document = yaml.safe_load(path.read_text())
    wrong = [{**MOTION[0], "positive": "flexion"}, MOTION[1]]
    for one in document["files"]:
        one["motion"] = wrong if one["specimen"] == "s02" else MOTION
    path.write_text(yaml.dump({**document, "motion": []}, Dumper=_Plain, sort_keys=False))
    assert run(tmp_path, path) == 1
    told = capsys.readouterr().err
    assert "files.2.motion.0.positive: found 'flexion'" in told
    assert "the sign of files.2.motion.0.positive, or of loads.0.positive" in told
    assert "files.0" not in told


@sweep("wrong", [(0,), (1,), (0, 1)])
def test_units_of_joints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: tuple[int, ...]
) -> None:
    """Radians told as degrees, of one joint or of both: each key is named."""
    joints = [{**MOTION[0], "column": n, "joint": j} for n, j in (("a", "L4L5"), ("b", "L5S1"))]
    path = rig(tmp_path, motion=joints, vertebrae=["S1", "L5", "L4"])
    document = yaml.safe_load(path.read_text())
    document |= {"files": document["files"][::2], "loads": LOADS[:1]}
    path.write_text(yaml.dump(document, Dumper=_Plain, sort_keys=False))
    for file in tmp_path.glob("s*flexion.csv"):
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        table[:, 3] = table[:, 2] * 0.9
        table[:, [2 + n for n in wrong]] *= np.pi / 180.0
        np.savetxt(file, table, "%.6f", ",", header="torque_a,torque_b,a,b", comments="")
    assert run(tmp_path, path) == 1
    told = capsys.readouterr().err
    named = ", ".join(f"motion.{n}.unit" for n in wrong)
    assert f"suspected: rad; correct {named}" in told
    assert len(wrong) > 1 or "loads.0" not in told


@sweep(
    "old, new, told",
    [
        ("loads:\n- ", "loads:\n  ", "loads: found {'column'"),
        (
            "vertebrae:\n- L5\n- L4\n",
            "vertebrae: L5\n",
            "allowed: a list; begin each item with `- `",
        ),
        (
            "title: made up",
            "title: made up\ntime: Time",
            "time: found 'Time'; allowed: keys; write",
        ),
        ("cohort: rig", "cohort: Rig", "allowed: a name of a-z, 0-9, _"),
        (
            "specimen: s02",
            "specimen: 2024-01-31",
            "found 2024-01-31; allowed: a valid string; put it in q",
        ),
        ("column: torque_a", "column: [1]", "loads.0.column: found [1]"),
        (
            "- L4\n",
            "- 4L\n",
            "vertebrae.1: found '4L'; allowed: a name of A-Z, a-z, 0-9 that begins",
        ),
    ],
)
def test_settings_of_the_wrong_form_are_told_in_words_of_a_yaml(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, told: str
) -> None:
    path = rig(tmp_path, loads=LOADS[:1] * 2)
    document = path.read_text().replace(
        "- column: torque_a\n  unit: N m\n  positive: extension\n", "", 1
    )
    assert old in document
    path.write_text(document.replace(old, new))
    assert run(tmp_path, path) == 1
    said = capsys.readouterr().err.replace("\n  ", "; ")
    assert told in said
    for word in ("tuple", "Tuple", "instance", "pattern", "constrained", "datetime"):
        assert word not in said
    assert "at least 2 of them" not in said


def test_what_somebody_said_of_a_cohort_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """``made_up`` is no finding of files; rows that a study needs are asked for, not refused."""
    path = rig(tmp_path)
    assert run(tmp_path, path) == 0
    folder = tmp_path / "config" / "cohorts" / "rig"
    header = folder / "cohort.yaml"
    header.write_text(header.read_text() + "made_up: true\n")
    rows = "specimen,marker,vertebra,x_mm,y_mm,z_mm,weight,cluster\ns01,m,L4,-60,0,0,,\n"
    (folder / "marker_set.csv").write_text(rows)
    capsys.readouterr()
    assert run(tmp_path, path, "--replace") == 0
    said = capsys.readouterr().out
    assert cohorts.read(folder).made_up
    assert "made_up: true of cohort.yaml" in said
    assert "0 markers of 's02' on S1" in said
    assert "which studies that read this file ask for" in said


def test_columns_may_name_the_other_side_in_passing_and_constant_ones_are_deleted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig(tmp_path, names={"a": "Flexion (unloaded)", "b": "Disp at load cell"})
    path.write_text(
        path.read_text().replace("column: a\n", "column: Flexion (unloaded)\n")
        .replace("column: b\n", "column: Disp at load cell\n")
    )  # fmt: skip
    assert run(tmp_path, path) == 0
    for file in tmp_path.glob("s*.csv"):
        lines = file.read_text().splitlines()
        cut = [",".join([*line.split(",")[:3], "0"]) for line in lines[1:]]
        file.write_text("\n".join([lines[0], *cut]) + "\n")
    assert run(tmp_path, path, "--replace") == 1
    assert "delete motion.1, where" in capsys.readouterr().err


def test_keys_of_the_cohort_are_told_where_they_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rig(tmp_path, title="long " * 80)
    assert run(tmp_path, path) == 1
    assert "rig.yaml, line 2, title: found" in capsys.readouterr().err
    path = rig(tmp_path, vertebrae=["L4", "L5"], motion=changed(MOTION, joint="L5L4"))
    assert run(tmp_path, path) == 1
    assert "rig.yaml, line 4, vertebrae: found 'L4' before 'L5'" in capsys.readouterr().err


def test_rows_far_apart_do_not_make_a_file_coarse() -> None:
    far = np.array([0.0, 0.6512, 1.3007, 1.9533, 2.6041])
    assert _resolution(far) == pytest.approx(1e-4)
    assert _resolution(np.repeat(far.round(1), 5)) == pytest.approx(0.6)


def test_axes_of_a_camera_are_told_at_its_markers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two axes turned round turn the rotation about a third."""
    time = np.arange(len(cycles())) / 10.0
    turn = np.radians(DEG_PER_NM * cycles())
    camera = [time]
    for x, y, z in ((30.0, 0.0, 0.0), (-20.0, 5.0, 25.0), (-20.0, 0.0, -25.0)):
        camera += [x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)]
        camera.append(np.full_like(turn, z))
    names = ",".join(["t", *(f"{m} {axis}" for m in "abc" for axis in "xyz")])
    np.savetxt(tmp_path / "seen.csv", np.transpose(camera), "%.5f", ",", header=names, comments="")
    np.savetxt(
        tmp_path / "load.csv",
        np.transpose([time, cycles()]),
        "%.5f",
        ",",
        header="t,m",
        comments="",
    )
    clock = {"column": "t", "unit": "s"}
    for axes, told in (
        (["anterior", "superior", "right"], None),
        (
            ["posterior", "superior", "left"],
            "look at `positive` of loads and motion or at `markers`",
        ),
        (["anterior", "right", "inferior"], "motion_files.markers"),
    ):
        markers = {"clusters": {"L4": ["a", "b", "c"]}, "axes": axes}
        file = {"file": "load.csv", "motion_file": "seen.csv", "shift_s": 0.0}
        document = {
            **{"cohort": "rig", "title": "made up", "source": "none", "vertebrae": ["L5", "L4"]},
            **{"time": clock, "loads": [{**LOADS[0], "column": "m"}]},
            "motion_files": {"time": clock, "markers": markers},
            "files": [{**file, "specimen": "s01", "test": "extension_flexion"}],
        }
        path = tmp_path / "rig.yaml"
        path.write_text(yaml.dump(document, Dumper=_Plain, sort_keys=False))
        status = run(tmp_path, path, "--replace")
        said = capsys.readouterr().err
        assert (status == 0) if told is None else (told in said), said
