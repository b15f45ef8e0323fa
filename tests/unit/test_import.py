"""`spinepipe import`: a machine's file with a known hidden law becomes a sound cohort.

The files are made by a generator that knows nothing of the library (tests/generators/
testing_machine.py); true values come from its closed forms.

Catches a machine's file read in a wrong unit, sign, zero or cycle.
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.calibration import Problem, fit
from spinepipe.cli import main
from spinepipe.cohort.measured import measured_specimen
from spinepipe.cohort.specimen import joint_frames, on_bushings
from spinepipe.imports.imported import write
from spinepipe.imports.registry import read as imported
from spinepipe.imports.registry import read_settings
from spinepipe.problems import InputError
from spinepipe.statics import free_parameters
from spinepipe.testing_machine import folder as folders
from spinepipe.testing_machine.cycles import segment
from tests.generators.testing_machine import Rig, german, record
from tests.generators.testing_machine import main as write_example

NOISY = Rig(cycles=3, hertz=10.0, friction_nm=0.4, noise_deg=0.05, noise_nm=0.03)
STIFFNESS = 1.7
"""N m/deg."""

DOCUMENT = {
    "cohort": "rig",
    "title": "made up",
    "source": "no measurement",
    "vertebrae": ["L5", "L4"],
    "form": {"delimiter": "semicolon", "decimal": "comma", "names_line": 3, "first_line": 5},
    "time": {"column": "Zeit", "unit": "s"},
    "loads": [{"column": "Moment", "unit": "N mm", "positive": "flexion"}],
    "motion": [
        {"column": "Winkel", "unit": "deg", "joint": "L4L5", "positive": "flexion"},
    ],
    "files": [{"file": "raw.csv", "specimen": "s01", "test": "flexion_extension"}],
}


def linear(moment: np.ndarray) -> np.ndarray:
    return moment / STIFFNESS


def written(folder: Path, text: str | None = None, **changes: object) -> Path:
    """The YAML and the machine's file beside it."""
    rows = record(linear, NOISY, seed=5)
    (folder / "raw.csv").write_text(text or german(*rows, offset=-3.21), encoding="utf-8")
    path = folder / "rig.yaml"
    plain = json.loads(json.dumps({**DOCUMENT, **changes}))  # nothing shared, so no aliases
    path.write_text(yaml.safe_dump(plain))
    return path


def read(path: Path) -> folders.ImportedTests:
    return folders.read(path.parent, read_settings(path))


def motion_and_loads(imported: folders.ImportedTests) -> tuple[np.ndarray, np.ndarray]:
    """(C, T) extension, deg, and moment about z, N m."""
    (test,) = imported.tests
    return (
        np.array([cycle.motion[:, 0] for cycle in test.cycles]),
        np.array([cycle.loads[:, 5] for cycle in test.cycles]),
    )


def test_the_whole_way_from_a_file_to_a_stiffness(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path)
    assert main(["--root", str(tmp_path), "import", str(path)]) == 0
    told = capsys.readouterr().out
    assert "201 rows; the load runs from -7.5" in told
    assert "turns back 6 times: 3 cycles, 3 kept" in told
    assert main(["--root", str(tmp_path), "check", "rig"]) == 0
    cohort = cohorts.read(tmp_path / "config/cohorts/rig")
    frames = joint_frames(cohort, "s01")
    start = np.array([1e5, 1e5, 1e5, 40.0, 40.0, 40.0])
    model = on_bushings(cohort, "s01", frames, start, np.ones(6))
    free = free_parameters(model, 0, ("extension_nm_per_rad",), "per_specimen")
    cases = measured_specimen(cohort, "s01", cohort.tests).tested
    problem = Problem(model, cases, free, np.eye(6)[3], np.full(1, -4.0), np.full(1, 4.0))
    found = 40.0 * math.exp(fit(problem).x[0])
    # Friction lags both ways, which cancels, but at the two turns, which are read once: there the
    # joint turns less by 0.4 N m / k, and a line through zero is steeper by sum(M dM) / sum(M^2).
    squares = 4 * sum(level**2 for level in (1.5, 3.0, 4.5, 6.0)) + 2 * 7.5**2
    steeper = 2 * 7.5 * NOISY.friction_nm / squares
    assert found == pytest.approx(math.degrees(STIFFNESS) / (1 - steeper), rel=0.005)


def test_signs_units_and_steps(tmp_path: Path) -> None:
    """Positive numbers of the machine are flexion, which is negative extension here."""
    imported = read(written(tmp_path, zeroed=False))
    motion, loads = motion_and_loads(imported)
    assert loads.shape == (3, 21)
    sizes = [0, 1.5, 3, 4.5, 6, 7.5]
    expected = [*sizes, *sizes[-2::-1]]
    np.testing.assert_allclose(loads[0, :11], [-x for x in expected], atol=1e-9)
    np.testing.assert_allclose(loads[0, 10:], expected, atol=1e-9)
    at_peak = motion[:, 5].mean() - 3.21
    # friction holds all of its 0.4 N m after 7 N m of one way
    assert at_peak == pytest.approx(-(7.5 - 0.4) / STIFFNESS, abs=0.03)


def test_a_loop_stays_a_loop(tmp_path: Path) -> None:
    """Loading and unloading differ by what friction holds: 0.4 N m on either side."""
    motion, _ = motion_and_loads(read(written(tmp_path)))
    width = (motion[1:, 3] - motion[1:, 7]).mean()  # at -4.5 N m, there and back
    assert width == pytest.approx(2 * 0.4 / STIFFNESS, rel=0.1)


def test_time_is_that_of_the_steps(tmp_path: Path) -> None:
    (test,) = read(written(tmp_path)).tests
    for cycle in test.cycles:
        assert cycle.time is not None
        # straight lines of 40 s a cycle; a row is 0.1 s, noise of the load some rows
        np.testing.assert_allclose(cycle.time, np.linspace(0.0, 40.0, 21), atol=0.4)
        assert (np.diff(cycle.time) >= 0).all()


@sweep("noise", [0.02, 0.1])
def test_the_declared_sd_is_that_of_the_readings(tmp_path: Path, noise: float) -> None:
    """Readings of many made-up files scatter by what the import says, from residuals alone."""
    rig = replace(NOISY, cycles=1, noise_deg=noise, noise_nm=0.0, friction_nm=0.0)
    found, declared = [], []
    for seed in range(30):
        text = german(*record(linear, rig, seed), offset=0.0)
        imported = read(written(tmp_path, text, zeroed=False))
        found.append(motion_and_loads(imported)[0][0])
        assert imported.rotation is not None
        assert math.isnan(imported.rotation.cycles)
        assert imported.rotation.row == pytest.approx(noise, rel=0.25)
        declared.append(imported.rotation.sd)
    scatter = float(np.sqrt(np.var(found, axis=0, ddof=1).mean()))
    # 30 draws at 21 steps tell an SD within a few percent; correlated rows are not in these files
    assert np.mean(declared) == pytest.approx(scatter, rel=0.2)


def test_repeats_that_differ_more_than_noise_count(tmp_path: Path) -> None:
    time, moment, turned = record(linear, replace(NOISY, noise_deg=0.01), seed=2)
    drifting = turned * (1 + 0.05 * (time // 40.0))
    text = german(time, moment, drifting, 0.0)
    rotation = read(written(tmp_path, text)).rotation
    assert rotation is not None
    assert rotation.sd == rotation.cycles > 3 * rotation.regression


def test_noise_makes_no_reversal_and_spikes_are_told(tmp_path: Path) -> None:
    time, moment, turned = record(linear, replace(NOISY, noise_nm=0.4), seed=3)
    moment[[100, 700]] += 30.0
    turned[[300, 301]] = 60.0
    imported = read(written(tmp_path, german(time, moment, turned, 0.0)))
    (test,) = imported.tests
    assert test.recordings[0].spikes == 4
    assert test.cuts[0].reversals == 6
    assert len(test.cycles) == 3


@sweep("way", [1.0, -1.0])
def test_loads_to_one_side(tmp_path: Path, way: float) -> None:
    rig = replace(NOISY, both_sides=False, peak_nm=way * 5.0)
    imported = read(written(tmp_path, german(*record(linear, rig, 4), offset=1.0)))
    _, loads = motion_and_loads(imported)
    there = [0, 1, 2, 3, 4, 5]
    np.testing.assert_allclose(loads[2], [-way * x for x in [*there, *there[-2::-1]]], atol=1e-9)


@sweep("asked, sizes", [(100.0, [100, 300, 500]), (None, [97, 300, 500])])
def test_cycles_on_a_preload(tmp_path: Path, asked: float | None, sizes: list[float]) -> None:
    """Compression between 100 and 500 N: the load never comes near zero."""
    rig = replace(NOISY, both_sides=False, peak_nm=400.0, friction_nm=0.0, noise_nm=1.0)
    time, force, moved = record(lambda load: load / 1000.0, rig, seed=9)
    text = german(time, (force + 100.0) / 1000.0, moved, 0.3)  # the table has thousands in it
    changes = {
        "loads": [{"column": "Moment", "unit": "N", "positive": "inferior"}],
        "motion": [{"column": "Winkel", "unit": "mm", "joint": "L4L5", "positive": "inferior"}],
        "load_point_mm": [0, 20, 0],
        "steps": {"per_side": 2, "reference": asked},
    }
    (test,) = read(written(tmp_path, text, **changes)).tests
    assert len(test.cycles) == 3
    expected = [-size for size in [*sizes, sizes[1], sizes[0]]]
    np.testing.assert_allclose(test.cycles[1].loads[:, 1], expected, atol=3.0)
    reached = test.cycles[1].motion[:, 0] * 1000.0
    np.testing.assert_allclose(reached, np.array(expected) - expected[0], atol=60.0)  # 3 SD


def test_a_load_held_at_each_level(tmp_path: Path) -> None:
    """Ten seconds at each level, a jump between them: the reading is the mean over the hold."""
    sizes = [0, 2.5, 5, 7.5, 5, 2.5, 0, -2.5, -5, -7.5, -5, -2.5, 0]
    rng = np.random.default_rng(1)
    moment = np.repeat(sizes * 3, 50) + rng.normal(0.0, 0.02, 50 * 39)
    time = np.arange(len(moment)) / 5.0
    text = german(time, moment, linear(moment), 0.0)
    changes = {"steps": {"levels": [2.5, 5, 7.5]}}
    motion, loads = motion_and_loads(read(written(tmp_path, text, **changes)))
    np.testing.assert_allclose(loads, [[-size for size in sizes]] * 3, atol=1e-9)
    np.testing.assert_allclose(motion, loads / STIFFNESS, atol=0.03)


def test_a_load_that_only_rises_is_half_a_cycle(tmp_path: Path) -> None:
    time, moment, turned = (part[:101] for part in record(linear, NOISY, seed=6))
    imported = read(written(tmp_path, german(time, moment, turned, 0.0)))
    _, loads = motion_and_loads(imported)
    assert loads.shape == (1, 6)


def test_what_is_cut_off_or_falls_short_is_left_out_and_told() -> None:
    steps = np.linspace(0.0, 1.0, 50)
    one = np.concatenate([steps, steps[::-1]])
    found = segment(np.concatenate([one, 0.5 * one, one, one, steps]), 0.2, 1)
    assert [number for number, _ in found.kept] == [3, 4]
    reasons = dict(found.left_out)
    assert reasons[1] == "preconditioning"
    assert "it reaches only 0.5" in reasons[2]
    assert "ends before" in reasons[5]


def test_cycles_of_several_files_of_a_test_are_repeats(tmp_path: Path) -> None:
    path = written(tmp_path, files=[FILE, {**FILE, "file": "again.csv"}])
    (tmp_path / "again.csv").write_bytes((tmp_path / "raw.csv").read_bytes())
    (test,) = read(path).tests
    assert len(test.cycles) == 6


def test_asked_levels_and_a_force_on_the_side(tmp_path: Path) -> None:
    """Another load is carried along, in its own unit; columns told by number, decimal points."""
    time, moment, turned = record(linear, replace(NOISY, noise_nm=0.0), seed=7)
    rows = zip(time, moment, 0.01 * moment + 0.2, np.radians(turned), strict=True)
    text = "\n".join("\t".join(f"{cell:.6f}" for cell in row) for row in rows)
    changes = {
        "form": {"delimiter": "tab", "names_line": 0},
        "time": {"column": 1, "unit": "s"},
        "loads": [
            {"column": 2, "unit": "N m", "positive": "right_bending"},
            {"column": 3, "unit": "kN", "positive": "inferior"},
        ],
        "motion": [{"column": 4, "unit": "rad", "joint": "L4L5", "positive": "right_bending"}],
        "load_point_mm": [0, 20, 0],
        "steps": {"levels": [2, 5]},
        "files": [{"file": "raw.csv", "specimen": "s01", "test": "bending", "driving": 2}],
    }
    write(imported(written(tmp_path, text, **changes)), tmp_path / "rig", replace=False)
    cohort = cohorts.read(tmp_path / "rig")
    assert cohort.loads is not None
    first = cohort.loads[cohort.loads["cycle"] == 1]
    assert list(first["mx_nm"]) == [0, 2, 5, 2, 0, -2, -5, -2, 0]
    expected = -10.0 * first["mx_nm"] - 200.0
    np.testing.assert_allclose(first["fy_n"], expected, atol=0.5)  # 0.1 % of the force
    assert cohort.motion is not None
    assert cohort.motion["right_bending_deg"].max() == pytest.approx(5.0 / STIFFNESS, abs=0.4)


def test_nothing_is_overwritten_unless_told(tmp_path: Path) -> None:
    path = written(tmp_path)
    command = ["--root", str(tmp_path), "import", str(path)]
    assert main(command) == 0
    folder = tmp_path / "config/cohorts/rig"
    (folder / "motion.csv").write_text("mine")
    joints = (folder / "joints.csv").read_text().replace("s01,L4L5,0,", "s01,L4L5,-2,")
    (folder / "joints.csv").write_text(joints)
    assert main(command) == 1
    assert (folder / "motion.csv").read_text() == "mine"
    assert main([*command, "--replace"]) == 0
    assert len(pd.read_csv(folder / "motion.csv")) == 63
    assert (folder / "joints.csv").read_text() == joints
    assert [one.name for one in folder.parent.iterdir()] == ["rig"]


def test_what_its_tables_are_is_told_beside_them_and_changes_no_result(tmp_path: Path) -> None:
    command = ["--root", str(tmp_path), "import", str(written(tmp_path))]
    assert main(command) == 0
    folder = tmp_path / "config/cohorts/rig"
    (folder / "specimens.csv").write_text("specimen,age_years,donor\ns01,61,x\n")
    assert main([*command, "--replace"]) == 0
    told = json.loads((folder / "datapackage.json").read_text("utf-8"))
    paths = [resource["path"] for resource in told["resources"]]
    assert paths == ["specimens.csv", "joints.csv", "loads.csv", "motion.csv"]
    for resource in told["resources"]:
        fields = resource["schema"]["fields"]
        frame = pd.read_csv(folder / resource["path"])
        assert [field["name"] for field in fields] == list(frame)
        for field in fields:
            if field["type"] == "string":
                assert not pd.api.types.is_numeric_dtype(frame[field["name"]])
            else:
                assert pd.api.types.is_numeric_dtype(frame[field["name"]])
            if field.get("constraints", {}).get("required"):
                assert frame[field["name"]].notna().all()
    age = told["resources"][0]["schema"]["fields"][1]
    assert (age["type"], age["unit"], age["constraints"]["maximum"]) == ("number", "years", 130)
    digest = cohorts.read(folder).digest
    (folder / "datapackage.json").unlink()
    assert cohorts.read(folder).digest == digest


LOAD = DOCUMENT["loads"][0]
MOTION = DOCUMENT["motion"][0]
FILE = DOCUMENT["files"][0]


@sweep(
    "changes, says",
    [
        ({"motion": [{**MOTION, "joint": "L5L4"}]}, "'L5L4'; allowed: one of L4L5"),
        ({"loads": [{**LOAD, "unit": "N"}]}, "'flexion' in N; allowed: one of anterior"),
        ({"loads": [{**LOAD, "unit": "kNm"}]}, "line 14, loads.0.unit: found 'kNm'"),
        ({"files": []}, "files: found []; allowed: at least 1 of them"),
        ({"loads": [{**LOAD, "unit": "N", "positive": "anterior"}]}, "load_point_mm"),
        ({"loads": [LOAD, {**LOAD, "column": "F"}]}, "mz_nm from two columns"),
        ({"loads": [LOAD, {**LOAD, "column": "F"}]}, "add `driving:`"),
        ({"motion": [{**MOTION, "column": "Moment"}]}, "column 2, which is told twice"),
        ({"files": [{**FILE, "driving": "Momant"}]}, "did you mean 'Moment'?"),
        ({"files": [{**FILE, "test": "../flexion"}]}, "files.0.test: found '../flexion' with '/'"),
        ({"files": [{**FILE, "specimen": "s 1"}]}, "files.0.specimen: found 's 1' with"),
        ({"loaded": "L5"}, "loaded: found 'L5'; allowed: one of L4"),
        ({"cyles": 2}, "an unknown key"),
        ({"form": {**DOCUMENT["form"], "first_line": 2}}, "a line below the names"),
        ({"form": {"names_line": 0}}, "tell the column's number"),
        ({"files": [{**FILE, "file": "row.csv"}]}, "row.csv: found no such file"),
        ({"time": {"column": "Zeitt", "unit": "s"}}, "did you mean 'Zeit'?"),
        ({"form": {**DOCUMENT["form"], "decimal": "point"}}, "set `form: {decimal: comma}`"),
        ({"form": {**DOCUMENT["form"], "delimiter": "tab"}}, "is `form.delimiter` right?"),
        ({"form": {**DOCUMENT["form"], "first_line": 4}}, "line 4, Zeit: found 's'"),
        ({"steps": {"reference": 9.0}}, "a reference of 9; allowed: -7.5"),
        ({"steps": {"levels": [2.5, 10]}}, "load steps at 10; allowed: at most 7."),
        ({"files": [{**FILE, "preconditioning_cycles": 3}]}, "3 cycles, of which none is kept"),
    ],
)
def test_every_fault_has_a_place_and_a_remedy(
    tmp_path: Path, changes: dict[str, object], says: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(written(tmp_path, **changes))
    assert says in str(caught.value)


def test_all_faults_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    lines = german(*record(linear, NOISY, seed=8), offset=0.0).splitlines()
    lines[10] = lines[10].replace(";", ";x", 1)
    lines[20] = lines[20].rpartition(";")[0] + ";"
    lines[21] = lines[21].rpartition(";")[0] + ";nan"
    lines[30] = "0,00;" + lines[30].partition(";")[2]
    with pytest.raises(InputError) as caught:
        read(written(tmp_path, "\n".join(lines)))
    told = [(p.row, p.column) for p in caught.value.problems]
    assert told == [(31, "Zeit"), (11, "Moment"), (21, "Winkel")]
    assert "an empty cell and 1 more such lines" in str(caught.value)


ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "testing_machine"


def test_the_example_is_that_of_the_generator(tmp_path: Path) -> None:
    write_example(tmp_path)
    made = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_text() for path in EXAMPLE.glob("*.csv")}


def test_the_example_of_the_tutorial_is_what_comes_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--root", str(tmp_path), "import", str(EXAMPLE / "rig.yaml")]) == 0
    told = capsys.readouterr().out.splitlines()
    page = (ROOT / "docs" / "tutorial.md").read_text().replace("1 281", "1\u2009281").splitlines()
    assert all("    " + line in page for line in told[:3]), told[:3]
    assert main(["--root", str(tmp_path), "check", "example_rig"]) == 0
