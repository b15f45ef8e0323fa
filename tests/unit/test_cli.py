"""The command line: what it prints, what it writes, how it ends.

Catches a command that prints another answer, writes elsewhere or ends well where it should not.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import grid_cases
import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, Chains
from cohort_cases import swap, text, without, write
from cohort_edge_cases import A
from mistaken_cohorts import good
from study_cases import STUDY, Size, project, results

from spinepipe import tables
from spinepipe.cli import doctor, main
from spinepipe.cli.engine import relative_error
from spinepipe.jobs import digest
from spinepipe.studies.registry import every_kind
from spinepipe.studies.tables import CONCLUSIONS
from tests.generators import ais_films

ROOT = Path(__file__).resolve().parents[2]


Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit code, standard output and standard error of a command."""

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        told = capsys.readouterr()
        assert "Traceback" not in told.err
        return code, told.out, told.err

    return run


def test_check_all(tmp_path: Path, run: Run) -> None:
    project(tmp_path, Size())
    code, out, _ = run("--root", tmp_path, "check")
    assert code == 0
    assert out.splitlines() == [
        "ok    config/config.yaml: a plain run builds probe",
        "ok    study probe: joint_pose_sensitivity on cohort straight; the data tell 2 of 2 free "
        "stiffnesses (superior, extension)",
        "ok    cohort straight: 2 specimens, 2 joints, 1 test, 8 rows of motion",
    ]


PURE_MOMENTS = (
    "study: pose\nkind: joint_pose_sensitivity\ncohort: t12s1_phantom\nposes: 200\n"
    "landmark_sd_mm: 1\nbest_models: 2\n"
)


@pytest.mark.parametrize("free", ["", "[anterior, superior, extension]"])
def test_check_tells_how_much_the_data_tell(tmp_path: Path, run: Run, free: str) -> None:
    """Moments, and rotations alone were read: translations asked for are warned of."""
    file = good("t12s1_phantom", tmp_path / "config/cohorts") / "motion.csv"
    motion = pd.read_csv(file)
    motion[["anterior_mm", "superior_mm", "right_mm"]] = np.nan
    motion.to_csv(file, index=False)
    (tmp_path / "config/studies").mkdir()
    asked = f"calibration: {{free: {free}}}\n" if free else ""
    (tmp_path / "config/studies/pose.yaml").write_text(PURE_MOMENTS + asked)
    code, out, _ = run("--root", tmp_path, "check", "pose")
    assert code == 0
    if not free:
        told = "the data tell 3 of 3 free stiffnesses (extension, right_bending, left_rotation)"
        assert told in out
        assert "warn" not in out
    else:
        assert "the data tell 1 of 3 free stiffnesses" in out
        (line,) = [line for line in out.splitlines() if line.startswith("warn")]
        assert "pose.yaml, calibration.free: found 3 stiffnesses, of which the data of" in line
        assert line.endswith("leave some out: anterior, superior would keep their start")


def test_check_tells_each_problem_once(tmp_path: Path, run: Run) -> None:
    project(tmp_path, Size())
    write(tmp_path / "config/cohorts/small", swap("bodies.csv", "a,L3,0.06", "a,L3,-1"))
    path = tmp_path / "config/studies/probe.yaml"
    path.write_text(path.read_text().replace("straight", "small") + "sed: 4\n")
    code, out, _ = run("check", "--root", tmp_path)
    assert code == 1
    assert out.count("bodies.csv, line 2, mass_kg") == 1
    assert "probe.yaml, line 10, sed" in out
    assert "FAIL  cohort small (1 problem of these told above)" in out
    assert "ok    cohort straight" in out
    assert "2 problems in all" in out


def test_check_by_name(tmp_path: Path, run: Run) -> None:
    project(tmp_path, Size())
    code, out, _ = run("--root", tmp_path, "check", "straight", "probe")
    assert (code, len(out.splitlines())) == (0, 2)
    code, _, err = run("--root", tmp_path, "check", "prob")
    assert (code, err) == (
        2,
        'error: there is no study or cohort "prob"\n  did you mean probe?\n',
    )
    code, out, _ = run("--root", tmp_path, "check", "probe")
    assert out.splitlines()[-1] == "Next: spinepipe plan probe"


def test_check_for_programs_and_quiet_ones(tmp_path: Path, run: Run) -> None:
    """One document with all that is wrong; or, with --quiet, what is wrong alone."""
    project(tmp_path, Size())
    path = tmp_path / "config/studies/probe.yaml"
    assert run("--root", tmp_path, "check", "-q") == (0, "", "")
    path.write_text(path.read_text() + "sed: 4\n")
    code, out, _ = run("--root", tmp_path, "check", "--json")
    told = json.loads(out)
    assert (code, [one["column"] for one in told["problems"]]) == (1, ["sed"])
    assert {one["name"]: one["ok"] for one in told["checked"]}["study probe"] is False
    code, out, _ = run("--root", tmp_path, "check", "--quiet")
    assert (code, out.splitlines()[0]) == (1, "FAIL  study probe")
    code, out, err = run("--root", tmp_path, "show", "straight", "--json")
    assert (code, json.loads(out)["error"] in err) == (2, True)


def test_check_of_results_removes_damaged_ones_and_nothing_else(tmp_path: Path, run: Run) -> None:
    root = grid_cases.project(tmp_path)
    results = root / f"results/{grid_cases.STUDY}"
    own, other = results / "notes.csv", root / "results/validation/table.csv"
    damaged = results / "stiffness_sets.parquet"
    for path in (own, other, damaged):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("a,b\n")
    code, _, error = run("--root", root, "check", "--results", "..")
    assert code != 0
    assert 'there is no study ".."' in error
    assert damaged.exists()
    code, out, _ = run("--root", root, "check", "--results")
    assert code == 1
    assert f"FAIL  results/{grid_cases.STUDY}/stiffness_sets.parquet: damaged" in out
    assert (own.exists(), other.exists(), damaged.exists()) == (True, True, False)


def test_check_in_the_wrong_folder(tmp_path: Path, run: Run) -> None:
    code, _, err = run("--root", tmp_path, "check")
    assert code == 1
    assert "pass --root" in err


@pytest.mark.parametrize("name", ["probe", "straight", "./config/cohorts/straight"])
def test_show(tmp_path: Path, run: Run, name: str) -> None:
    project(tmp_path, Size())
    code, out, _ = run("--root", tmp_path, "show", name, "b")
    assert code == 0
    assert "specimen   b (2 of 2)" in out
    assert "  V2V3   " in out
    assert "flexion      1     1  V1           0   -20" in out
    page = (tmp_path / "results" / "show" / f"{Path(name).name}-b.html").read_text()
    assert page.index("Measured motion") < page.index("Geometry") < page.index("All numbers")
    assert page.count("<h2>Measured ") == 1, "the tests drive one coordinate"
    assert "specimen   b (2 of 2)" in page
    assert 'class="view spine3d"' in page


def test_show_without_landmarks_bodies_motion(tmp_path: Path, run: Run) -> None:
    frame = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg\n"
    rows = "".join(f"{s},{j}\n" for s in "ab" for j in ("L3L4,0,5,0,-3,0,0", "L2L3,0,41,0,4,0,0"))
    changes = [text("joints.csv", frame + rows), swap("cohort.yaml", "true", "false")]
    changes += [without(f"{name}.csv") for name in ("landmarks", "bodies", "loads", "motion")]
    write(tmp_path / "config/cohorts/small", *changes)
    picture = tmp_path / "a.svg"
    code, out, _ = run("--root", tmp_path, "show", "small", "-o", picture)
    assert code == 0
    assert "bodies: none" in out
    assert "measured motion: none" in out
    assert "no picture: no motion was measured" in out
    assert not picture.exists()


def test_show_moments_of_several_tests(tmp_path: Path, run: Run) -> None:
    header = "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm"
    tests = {"flexion": "0,0,-7.5", "right_bending": "7.5,0,0", "left_rotation": "0,7.5,0"}
    rows = [
        f"*,{test},{step},L2,0,0,0,{moment if step else '0,0,0'}"
        for test, moment in tests.items()
        for step in (0, 1)
    ]
    loads = text("loads.csv", "\n".join([header, *rows]) + "\n")
    write(tmp_path / "config/cohorts/small", loads, without("motion.csv"))
    code, out, _ = run("--root", tmp_path, "show", "small")
    assert code == 0
    assert "left_rotation" in out
    assert "No motion was measured" in (tmp_path / "results" / "show" / "small.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["straigt"], "did you mean straight?"),
        (["straight", "z"], 'there is no specimen "z"\n  they are a, b'),
        (["straight", "-o", "x.bmp"], "found x.bmp; allowed: .html, .png, .svg, .pdf"),
    ],
)
def test_show_of_what_is_not_there(
    tmp_path: Path, run: Run, arguments: list[str], says: str
) -> None:
    project(tmp_path, Size())
    code, _, err = run("--root", tmp_path, "show", *arguments)
    assert code == (2 if "there is no" in says or "did you" in says else 1)
    assert says in err


def bushing(file: Path, joint: str) -> list[float]:
    """Rotational stiffness of a joint in an OpenSim file: axial rotation, extension, bending... as
    the bushing's own axes have them: those of the joint's z, x, y.
    """
    found = ElementTree.parse(file).find(f".//BushingForce[@name='{joint}_bushing']")
    return [float(word) for word in found.findtext("rotational_stiffness").split()]


def test_export(tmp_path: Path, run: Run) -> None:
    """1 N m turns each joint by 1.5 degrees: fitted it has about 38.2 N m/rad."""
    results(project(tmp_path, Size()), Size())
    file = tmp_path / "out" / "a.osim"
    code, out, _ = run("--root", tmp_path, "export", STUDY, "a", "-o", file)
    assert code == 0
    assert "joint pose nominal, stiffness: fitted in this pose" in out
    fitted = bushing(file, "V2V3")
    code, out, _ = run("--root", tmp_path, "export", STUDY, "a", "--start", "-o", file)
    assert code == 0
    assert "joint pose nominal, stiffness: start of the study" in out
    assert bushing(file, "V2V3")[0] == 37.0 != fitted[0]
    assert fitted[0] == pytest.approx(1.0 / np.deg2rad(1.5), rel=0.1)  # 20 N turn it a little too
    nominal = file.read_text()
    code, out, _ = run("--root", tmp_path, "export", STUDY, "a", "--pose", 3, "-o", file)
    assert code == 0
    assert "joint pose 0003, stiffness: calibrated for this pose" in out
    assert file.read_text() != nominal


@pytest.mark.parametrize("kind", ["range_of_motion", "global_sensitivity"])
def test_export_of_studies_that_fit_nothing(tmp_path: Path, run: Run, kind: str) -> None:
    more = (
        "factors:\n  - {of: load_size, times: {sd: 0.02}}\n"
        "  - {of: joint_axes, axis: extension, offset_deg: {sd: 2}}\n"
        if kind == "global_sensitivity"
        else "poses: 1\n"
    )
    Chains({"a": A}).write(tmp_path)
    body = f"study: given\nkind: {kind}\ncohort: chains\nstiffness: {{extension_nm_per_rad: 44}}\n"
    (tmp_path / "config/studies/given.yaml").write_text(body + more)
    file = tmp_path / "a.osim"
    code, out, err = run("--root", tmp_path, "export", "given", "a", "-o", file)
    assert (code, err) == (0, "")
    assert "the study's own, nothing is fitted" in out
    assert bushing(file, "L4L5")[0] == 44.0
    code, _, err = run("--root", tmp_path, "export", "given", "a", "--pose", 1, "-o", file)
    assert code == 1
    assert "exports no sampled joints" in err


def test_export_of_a_cohort_study(tmp_path: Path, run: Run) -> None:
    """Each joint is as stiff as it was made; without results it is told what makes them."""
    chains = Chains({"a": A}).write(tmp_path)
    file, asked = tmp_path / "a.osim", ["--root", tmp_path, "export", "probe", "a", "-o"]
    code, _, err = run(*asked, file)
    assert code == 1
    assert "run `snakemake -j2 results/probe/ranking.parquet` first, or add --start" in err
    rows = chains.fit("a", "per_joint")["stiffness"]
    rows = rows.assign(specimen="a", representation="per_joint", fitted_to="all")
    (tmp_path / "results/probe").mkdir(parents=True)
    rows.to_parquet(tmp_path / "results/probe/stiffness.parquet")
    ranked = {"criterion": "left_out_case", "representation": ["per_specimen", "per_joint"]}
    pd.DataFrame({**ranked, "rank": [2, 1]}).to_parquet(tmp_path / "results/probe/ranking.parquet")
    code, out, _ = run(*asked, file)
    assert code == 0
    assert "fitted, each joint its own (first by left-out-case error)" in out
    for joint, (extension, bending, rotation) in zip(JOINTS, A, strict=True):
        told = bushing(file, joint)
        assert told == pytest.approx([extension, bending, rotation], rel=1e-3)
    code, _, err = run(*asked, file, "--representation", "per_specimen")
    assert code == 1
    assert "no fit of a by per_specimen" in err
    code, _, _ = run(*asked, file, "--start")
    assert (code, bushing(file, "L4L5")[0]) == (0, 51.0)


def test_export_of_a_law_that_stiffens_says_what_is_not_in_the_file(
    tmp_path: Path, run: Run
) -> None:
    name = "per_joint_stiffening"
    study = f"representations: [per_joint, {name}]\n"
    chains = Chains({"a": A}, growth={"a": 2.0}, study=study).write(tmp_path)
    rows = chains.fit("a", name)["stiffness"]
    rows = rows.assign(specimen="a", representation=name, fitted_to="all")
    (tmp_path / "results/probe").mkdir(parents=True)
    rows.to_parquet(tmp_path / "results/probe/stiffness.parquet")
    file = tmp_path / "a.osim"
    command = ["--root", tmp_path, "export", "probe", "a", "--representation", name, "-o", file]
    code, out, _ = run(*command)
    assert code == 0
    assert "at rest: that it grows with motion is not in the file" in out
    assert bushing(file, JOINTS[0])[0] == pytest.approx(A[0][0], rel=0.02)


def test_export_of_a_model_with_effects(tmp_path: Path, run: Run) -> None:
    """Bushings are written, and what OpenSim cannot say is named, outside and inside the file."""
    Chains({"a": A}).write(tmp_path)
    study = "study: lack\nkind: discrepancy\ncohort: chains\nbase: {stiffness: per_joint}\n"
    (tmp_path / "config/studies/lack.yaml").write_text(study)
    found = tmp_path / "results/lack/discrepancy/model_with_effects.yaml"
    found.parent.mkdir(parents=True)
    found.write_text(
        "model: lack\ncohort: chains\neffects:\n"
        "  - {effect: linear_bushing, values: [{extension_nm_per_rad: 33}]}\n"
        "  - {effect: neutral_zone}\n"
    )
    file = tmp_path / "a.osim"
    code, out, _ = run("--root", tmp_path, "export", "lack", "a", "-o", file)
    assert code == 0
    assert "not in the file, as OpenSim has no counterpart: neutral_zone" in out
    assert "In the model and not in this file: neutral_zone." in file.read_text()
    assert bushing(file, "L4L5")[0] == 33.0


def test_export_says_why_a_kind_has_none(tmp_path: Path, run: Run) -> None:
    kinds = every_kind()
    assert {name for name, kind in kinds.items() if not kind.exports} == {
        name for name, kind in kinds.items() if kind.why_no_export
    }
    arguments = ("--root", ROOT, "export", "ais18_scoliosis", "p01", "-o", tmp_path / "a.osim")
    code, _, err = run(*arguments)
    assert code == 1
    assert "films show rotations in one plane" in err


@pytest.mark.parametrize(
    ("computed", "arguments", "says"),
    [
        (
            False,
            [STUDY, "a", "--pose", "1", "-o", "a.osim"],
            "run `snakemake -j2 results/probe/poses",
        ),
        (True, [STUDY, "a", "--pose", "99", "-o", "a.osim"], "found pose 99; allowed: 0 to 11"),
        (True, [STUDY, "z", "-o", "a.osim"], 'there is no specimen "z"'),
        (True, ["prob", "a", "-o", "a.osim"], "did you mean probe?"),
        (True, [STUDY, "a", "-o", "a.xml"], "allowed: FILE.osim"),
        (
            True,
            [STUDY, "a", "--test", "flex", "-o", "a.osim"],
            "found flex; allowed: one of flexion",
        ),
        (False, [STUDY, "--tables", "all"], "run `snakemake -j2 results/probe/report.html` first"),
    ],
)
def test_export_of_what_is_not_there(
    tmp_path: Path,
    run: Run,
    computed: bool,
    arguments: list[str],
    says: str,
) -> None:
    project(tmp_path, Size())
    if computed:
        results(tmp_path, Size())
    code, _, err = run("--root", tmp_path, "export", *arguments)
    assert code == (2 if "there is no" in says or "probe?" in says else 1)
    assert says in err


def test_tables_are_exported_as_csv(tmp_path: Path, run: Run) -> None:
    """Each as it is, names of digits too; what cannot stand in a CSV stands beside it."""
    results(project(tmp_path, Size(specimens=("001", "002"))), Size(specimens=("001", "002")))
    folder = tmp_path / "tables"
    code, out, _ = run("--root", tmp_path, "export", STUDY, "--tables", folder)
    assert (code, "3 tables" in out) == (0, True)
    package = json.loads((folder / "datapackage.json").read_text())
    dtypes = {"string": str, "integer": "Int32", "number": float, "boolean": "boolean"}
    assert {one["name"] for one in package["resources"]} == {"poses", "calibrations", "simulations"}
    for one in package["resources"]:
        types = {field["name"]: dtypes[field["type"]] for field in one["schema"]["fields"]}
        read = pd.read_csv(folder / one["path"], dtype=types)
        table = pd.read_parquet(tmp_path / "results" / STUDY / f"{one['name']}.parquet")
        assert list(read) == list(table)
        for name, kind in types.items():
            if kind is float:
                np.testing.assert_allclose(read[name], table[name].astype(float), rtol=1e-15)
            else:
                cells = (one[name].astype(object).fillna("").tolist() for one in (read, table))
                assert next(cells) == next(cells)
        assert set(read["specimen"]) == {"001", "002"}
    tables.write(
        tables.from_rows(CONCLUSIONS, []), tmp_path / "results" / STUDY / "conclusions.parquet", {}
    )
    _, out, _ = run("--root", tmp_path, "export", STUDY, "--tables", folder)
    assert "4 tables" in out
    assert "conclusions.csv" in (folder / "datapackage.json").read_text()


def test_engine_agrees_with_the_closed_form() -> None:
    assert relative_error() < doctor.LARGEST_ERROR


def healthy(root: Path) -> Path:
    """A folder with which the doctor has no quarrel but the engine, which is not asked."""
    (root / "profiles" / "default").mkdir(parents=True)
    shipped = (ROOT / "profiles/default/config.yaml").read_text()
    (root / "profiles/default/config.yaml").write_text(shipped)
    (root / "requirements.lock").write_text((ROOT / "requirements.lock").read_text())
    return root


def test_doctor_on_a_sound_folder(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "check_engine", lambda root: "not asked")
    monkeypatch.setattr(doctor, "check_libraries", lambda root: "not asked")
    code, out, _ = run("--root", healthy(tmp_path), "doctor")
    assert code == 0
    assert [line.split()[:2] for line in out.splitlines()] == [
        ["ok", name]
        for name in ("python", "libraries", "engine", "profile", "results", "cache", "cores")
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["profiles", "requirements.lock"]


def test_an_environment_without_the_package_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where `make env` was cut off: by the doctor, and by a run before its first job."""

    def nothing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(doctor, "metadata", nothing)
    with pytest.raises(doctor.Trouble, match="spinepipe is not installed; run `make env`"):
        doctor.check_python(tmp_path)
    monkeypatch.setattr(digest, "version", lambda name: name == "spinepipe" and nothing(name))
    digest.versions.cache_clear()
    with pytest.raises(
        ImportError, match=r"the package spinepipe is not installed\. Run `make env`"
    ):
        digest.versions()


def test_doctor_finds_wrong_libraries(tmp_path: Path) -> None:
    (tmp_path / "requirements.lock").write_text("numpy==0.1 \\\n    --hash=x\nno-such-lib==2\n")
    with pytest.raises(doctor.Trouble, match=r"numpy is .*, not 0\.1, no-such-lib is missing"):
        doctor.check_libraries(tmp_path)
    with pytest.raises(doctor.Trouble, match="pass --root"):
        doctor.check_libraries(tmp_path / "elsewhere")


def test_doctor_finds_a_slow_profile(tmp_path: Path) -> None:
    path = healthy(tmp_path) / "profiles/default/config.yaml"
    assert "tuned" in doctor.check_profile(tmp_path)
    path.write_text(path.read_text().replace("force-use-threads: true", "force-use-threads: false"))
    with pytest.raises(doctor.Trouble, match="lacks force-use-threads: true; add it"):
        doctor.check_profile(tmp_path)
    path.unlink()
    with pytest.raises(doctor.Trouble, match="no profiles/default"):
        doctor.check_profile(tmp_path)


def test_doctor_finds_results_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file in the way")
    with pytest.raises(doctor.Trouble, match="cannot be written"):
        doctor.check_results(tmp_path)


NOBODYS = "/proc/self/cache"
"""A folder that nobody can make, not even root."""


def test_a_home_that_cannot_be_written_gives_way_to_the_project(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`make` and `spinepipe` keep caches there, and the doctor says how Snakemake alone would."""
    monkeypatch.setenv("XDG_CACHE_HOME", NOBODYS)
    monkeypatch.setenv("MPLCONFIGDIR", "/proc/self/other")
    own = tmp_path / ".snakemake/cache"
    with pytest.raises(doctor.Trouble, match=rf"^{NOBODYS} cannot.*`export XDG_CACHE_HOME={own}`"):
        doctor.check_cache(tmp_path)
    run("--root", tmp_path, "check")
    assert os.environ["MPLCONFIGDIR"] == f"{own}/matplotlib"
    shutil.copy(ROOT / "Makefile", tmp_path)
    asked = ["make", "-s", "--eval=told:\n\t@echo $$XDG_CACHE_HOME $$MPLCONFIGDIR", "told"]
    for home, told in ((NOBODYS, f"{own} {own}/matplotlib\n"), (f"{tmp_path}/home", "\n")):
        here = {"PATH": os.environ["PATH"], "HOME": home}
        assert subprocess.check_output(asked, cwd=tmp_path, env=here, text=True) == told


@pytest.mark.parametrize(
    ("code", "out", "says"),
    [
        (-11, "", r"crashed \(SIGSEGV\)"),
        (1, "", "engine failed: no pybullet"),
        (0, "0.5\n", "5.0e-01 from the closed form"),
        (0, "nan\n", "nan from the closed form"),
    ],
)
def test_doctor_finds_an_unsound_engine(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, code: int, out: str, says: str
) -> None:
    ended = SimpleNamespace(returncode=code, stdout=out, stderr="Traceback\nno pybullet\n")
    monkeypatch.setattr(doctor.subprocess, "run", lambda *_, **__: ended)
    with pytest.raises(doctor.Trouble, match=says):
        doctor.check_engine(tmp_path)


def test_doctor_ends_with_1_when_something_fails(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "check_engine", lambda root: "not asked")
    code, out, _ = run("--root", tmp_path, "doctor")
    assert code == 1
    assert "FAIL  profile" in out
    assert "ok    cores" in out


def test_docs(tmp_path: Path, run: Run) -> None:
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text("<!-- generated: effects -->\n<!-- end of generated -->\n")
    assert run("--root", tmp_path, "docs", "--check")[0] == 1
    code, out, _ = run("--root", tmp_path, "docs")
    assert (code, out.splitlines()[0]) == (0, "wrote docs/page.md")
    table = tmp_path / "docs" / "table" / "joint_pose_sensitivity" / "poses.md"
    assert "# poses.parquet" in table.read_text("utf-8")
    assert "linear_bushing" in page.read_text()
    assert run("--root", tmp_path, "docs", "--check")[0] == 0


def test_a_locale_of_ascii_alone_is_left_behind(tmp_path: Path) -> None:
    """Folders, names and words go beyond it; Python decides at its start what it can print."""
    root = tmp_path / "Rücken"
    root.mkdir()
    project(root, Size())
    header = root / "config/cohorts/straight/cohort.yaml"
    header.write_text(re.sub("(?m)^title:.*", "title: für Müller", header.read_text("utf-8")))
    here = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    command = [sys.executable, "-m", "spinepipe.cli", "--root", root, "show", "straight"]
    ended = subprocess.run(command, env=here, capture_output=True, check=False)
    assert ended.returncode == 0, ended.stderr.decode()
    assert "für Müller" in ended.stdout.decode()
    assert f"page: {root}/results/show/straight.html" in ended.stdout.decode()


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["--help"], 0, "doctor"),
        ([], 0, "doctor"),
        (["check", "--help"], 0, "--results"),
        (["--version"], 0, "spinepipe 0"),
        (["chek"], 2, 'error: there is no command "chek"\n  did you mean check?'),
        (["check", "--al"], 2, "error: no such option: --al"),
        (["export"], 2, "error: missing argument 'study'"),
    ],
)
def test_usage(run: Run, arguments: list[str], code: int, says: str) -> None:
    ended, out, err = run(*arguments)
    assert ended == code
    assert says in (err if code else out)


def test_a_broken_library_is_one_message(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "spinepipe.cli.check", None)
    code, _, err = run("check")
    assert code == 1
    assert "`spinepipe doctor` says what is missing" in err


@pytest.mark.parametrize(
    "named", [["linear_spines"], pytest.param([], marks=pytest.mark.full)], ids=["one", "all"]
)
def test_what_is_shipped_is_sound_to_the_program(named: list[str]) -> None:
    command = [sys.executable, "-m", "spinepipe.cli", "--root", str(ROOT), "check", *named]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_a_cohort_of_films_is_sound_and_shown_in_words(tmp_path: Path, run: Run) -> None:
    folder = tmp_path / "config" / "cohorts" / "ais"
    ais_films.write(folder, ais_films.READINGS["ais18_phantom"], count=2)
    code, out, _ = run("--root", tmp_path, "check", "ais")
    assert code == 0
    assert "2 specimens, 14 joints, 0 tests, 0 rows of motion, 150 rows of films" in out
    picture = tmp_path / "a.png"
    code, out, _ = run("--root", tmp_path, "show", "ais", "p02", "-o", picture)
    assert code == 0
    assert "joint frames in ground, neutral pose: none" in out
    assert "  traction" in out
    assert out.endswith("no picture: ais has neither landmarks.csv nor joints.csv to draw\n")
    assert not picture.exists()


def test_check_warns_of_units_and_ends_well(tmp_path: Path, run: Run) -> None:
    """Motion in radians: one line for each test and column, told once though a study reads it."""
    chains = Chains({"a": A, "b": 1.1 * A}, ["flexion"])
    chains.motion["extension_deg"] = np.deg2rad(chains.motion["extension_deg"])
    chains.motion[["right_bending_deg", "left_rotation_deg"]] = np.nan  # nobody measured them
    chains.write(tmp_path)
    code, out, _ = run("--root", tmp_path, "check")
    assert code == 0
    (warning,) = [line for line in out.splitlines() if line.startswith("warn")]
    assert warning.startswith("warn  chains/motion.csv, line 5, extension_deg: found extension_deg")
    assert "(all specimens, test flexion); allowed: 1/5 to 5 times" in warning
    assert warning.endswith(
        "suspected: angles in radians and not degrees (0.0175); convert the column"
    )
    assert "1 warning in all, which stop no run" in out
