"""Cohorts that are sound cell by cell and wrong: told at their place, and good ones never.

Catches a rule of `check` that sees a mistake no more, or doubts good data.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from cohort_cases import Change, swap, text
from cohort_cases import write as write_small
from fresh_mistakes import FRESH
from mistaken_cases import MISTAKES, XYZ
from mistaken_cohorts import (
    REAL,
    REAL_SPINES,
    SHIPPED,
    SMALL,
    Score,
    good,
    scores,
    there,
    told,
)
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cli.program import main
from spinepipe.frames import rotation_zxy
from spinepipe.plausibility.warnings.levels import NeutralPose
from spinepipe.plausibility.warnings.postures import _stray_deg
from spinepipe.problems import InputError
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.free import unmeasured
from spinepipe.studies.plausibility import doubts, refusals, suspicions
from spinepipe.studies.registry import every_form
from tests.generators.hidden import Recipe, make

Factory = pytest.TempPathFactory

COLUMNS, REMEDIES, ALONE = 0.95, 0.9, 0.85
"""Shares of a cohort's mistakes that name the column, how to mend it, and nothing else, at least;
docs/decisions/0039 has the shares over all cohorts."""


def judged(found: list[Score]) -> None:
    """Each mistake is told, and most of them well."""
    assert {(one.cohort, one.mistake) for one in found if not one.told} == set()
    for least, kind in ((COLUMNS, "column"), (REMEDIES, "remedy"), (ALONE, "alone")):
        right = [one.mistake for one in found if getattr(one, kind)]
        lacking = sorted({one.mistake for one in found} - set(right))
        assert len(right) >= least * len(found), f"{kind}: {lacking}"


def test_every_mistake_is_told_at_its_place(tmp_path: Path) -> None:
    """Each in the first cohort that can have it, of which two small ones have nearly all."""
    left, found = list(MISTAKES), []
    for name in (*SMALL, *SHIPPED):
        found += scores(name, left, tmp_path / name)
        made = {one.mistake for one in found}
        left = [mistake for mistake in left if mistake.name not in made]
    assert left == []
    judged(found)


@pytest.mark.full
@pytest.mark.parametrize("name", [*SMALL, *SHIPPED, *REAL_SPINES])
def test_every_mistake_is_told_in_every_cohort(name: str, tmp_path: Path) -> None:
    """344 mistakes in eleven cohorts, 53 of them in real spines."""
    if not there(name):
        pytest.skip("real spine geometry is not beside this repository")
    found = scores(name, MISTAKES, tmp_path)
    assert len(found) >= 4
    judged(found)


def test_some_mistakes_are_told_in_cohorts_of_every_form(tmp_path: Path) -> None:
    drawn = np.random.default_rng(3).permutation(np.array(MISTAKES, dtype=object))
    for number, name in enumerate(SHIPPED):
        found = scores(name, drawn[number::12], tmp_path / name)
        assert found, name
        assert [one.mistake for one in found if not one.told] == [], name


@sweep("name", [*SMALL, *REAL_SPINES])
def test_good_cohorts_are_not_doubted(name: str, tmp_path_factory: Factory) -> None:
    """Those that come along: see test_doubts."""
    if there(name):
        assert told(good(name, tmp_path_factory.mktemp("good"))) == ()


@pytest.mark.full
@pytest.mark.parametrize("name", ["small", "palanca_l1l4"])
def test_kinds_of_mistakes_that_came_later(name: str, tmp_path: Path) -> None:
    """A sample of what `python -m tests.validation plausibility` measures in eighteen cohorts."""
    found = scores(name, FRESH, tmp_path)
    assert len(found) >= 25
    assert sum(one.remedy for one in found) >= 0.6 * len(found)


def test_two_joints_are_enough_to_tell_axes_off_their_line() -> None:
    turned = np.array([rotation_zxy(np.deg2rad(30.0), 0.0, 0.0)] * 2)
    line = np.array([[0.0, 0.0, 0.0], [0.0, 35.0, 0.0]])
    pose = NeutralPose("s01", ("L5", "L4", "L3"), line, turned)
    assert _stray_deg(pose) == pytest.approx(30.0)


def test_necks_are_not_doubted(tmp_path: Path) -> None:
    make(Recipe(seed=41, region="cervical", joints=4), tmp_path / "necks")
    assert told(tmp_path / "necks") == ()


def test_a_free_coordinate_that_nobody_measured(tmp_path: Path) -> None:
    """Rotations alone were read; the file frees a translation by name, or nothing."""
    folder = good("linear_spines", tmp_path / "config" / "cohorts")
    cohort = cohorts.read(folder, every_form())
    (tmp_path / "config" / "studies").mkdir()
    head = {"study": "fit", "kind": "cohort_stiffness", "cohort": "linear_spines"}
    for free, lines in ((["extension", "anterior"], [4]), (["extension"], []), (None, [])):
        keys = {**head, **({} if free is None else {"free": free})}
        file = tmp_path / "config" / "studies" / "fit.yaml"
        file.write_text(yaml.safe_dump(keys, sort_keys=False, default_flow_style=None))
        found = unmeasured(tmp_path, CohortStiffness.model_validate(keys), cohort)
        assert [one.row for one in found] == lines
        assert all("anterior, which nobody measured" in one.found for one in found)


@pytest.mark.full
@pytest.mark.parametrize("name", REAL_SPINES)
def test_real_spines_are_not_doubted(name: str) -> None:
    """All of them, scoliotic ones too: 83 in CT."""
    if not (REAL / name).is_dir():
        pytest.skip("real spine geometry is not beside this repository")
    assert told(REAL / name) == ()


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.1, "cm and not mm (0.1)"), (1 / 25.4, "inches"), (10.0, "multiplied by 10")],
)
def test_a_spine_of_another_unit_is_refused_with_its_factor(
    factor: float, words: str, tmp_path: Path
) -> None:
    folder = good("linear_spines", tmp_path)
    scale(folder / "joints.csv", list(XYZ), factor)
    cohort = cohorts.read(folder, every_form())
    (refused,) = refusals(cohort)
    assert words in refused.remedy
    assert (refused.file, refused.row) == ("linear_spines/joints.csv", 2)
    assert "acknowledged_warnings: [lengths]" in refused.remedy


def test_what_is_meant_is_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = good("linear_spines", tmp_path / "config" / "cohorts")
    scale(folder / "joints.csv", list(XYZ), 10.0)
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 1
    assert "FAIL" in capsys.readouterr().out
    header = yaml.safe_load((folder / "cohort.yaml").read_text())
    (folder / "cohort.yaml").write_text(
        yaml.safe_dump({**header, "acknowledged_warnings": ["lengths"]})
    )
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 0
    assert "multiplied by 10" in capsys.readouterr().out
    (folder / "cohort.yaml").write_text(yaml.safe_dump({**header, "i_mean_it": ["lengths"]}))
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 0, "the key's old name"
    both = {**header, "i_mean_it": ["lengths"], "acknowledged_warnings": ["lengths"]}
    (folder / "cohort.yaml").write_text(yaml.safe_dump(both))
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 1, "one key, two names"
    (folder / "cohort.yaml").write_text(
        yaml.safe_dump({**header, "acknowledged_warnings": ["masses"]})
    )
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 1, "another group"


@pytest.mark.parametrize("key", ["acknowledged_warnings", "i_mean_it"])
def test_an_unknown_group_is_refused(key: str, tmp_path: Path) -> None:
    change = swap("cohort.yaml", "gravity: true", f"gravity: true\n{key}: [length]")
    with pytest.raises(InputError) as caught:
        cohorts.read(write_small(tmp_path / "small", change))
    (problem,) = caught.value.problems
    assert problem.file == "small/cohort.yaml"
    assert "lengths" in problem.remedy + problem.allowed


@pytest.mark.parametrize(
    ("sd", "refused"), [("1.0e-300", True), ("1.0e-7", True), ("1.0e-5", False), ("40.0", False)]
)
def test_errors_that_no_instrument_has(sd: str, refused: bool, tmp_path: Path) -> None:
    change: Change = swap("cohort.yaml", "rotation_deg: 0.1", f"rotation_deg: {sd}")
    cohort = cohorts.read(write_small(tmp_path / "small", change))
    found = refusals(cohort) if refused else doubts(cohort)
    assert any(one.column == "measurement_sd.rotation_deg" for one in found)
    assert bool(refusals(cohort)) == refused


@pytest.mark.parametrize(
    ("name", "column"), [("t12s1_phantom", "step"), ("l4l5_disc", "step"), ("linear_spines", "x")]
)
def test_step_0_against_the_flag(name: str, column: str, tmp_path: Path) -> None:
    """Readings that are all 0 were zeroed; where they are not, they were not."""
    folder = good(name, tmp_path)
    header = yaml.safe_load((folder / "cohort.yaml").read_text())
    turned = {**header, "zeroed_at_step_0": not header["zeroed_at_step_0"]}
    (folder / "cohort.yaml").write_text(yaml.safe_dump(turned))
    found = [one for one in suspicions(cohorts.read(folder)) if one.group == "zeroing"]
    assert [one.certain for one in found] == [column != "step"]
    assert found[0].problem.file == f"{name}/motion.csv"


def test_what_a_mean_left_is_no_last_step_that_stands_first(tmp_path: Path) -> None:
    """In a loop that ends at 0; the error of a reading that is stated does not explain it."""
    angles = enumerate((0.5, 2, 3, 1, 0))
    loop = "".join(f"a,flexion,1,{step},L3L4,{angle}\n" for step, angle in angles)
    loads = "".join(
        f"a,flexion,{step},L2,0,0,0,0,0,{moment}\n" for step, moment in enumerate((0, 1, 2, 1, 0))
    )
    files = (
        swap("cohort.yaml", "zeroed_at_step_0: false", "zeroed_at_step_0: true"),
        text("motion.csv", f"specimen,test,cycle,step,joint,extension_deg\n{loop}"),
        text("loads.csv", f"specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm\n{loads}"),
    )
    cohort = cohorts.read(write_small(tmp_path / "small", *files))
    (problem,) = [one.problem for one in suspicions(cohort) if one.group == "zeroing"]
    assert "measurement_sd" in problem.remedy


def test_vertebrae_of_other_names_are_not_judged(tmp_path: Path) -> None:
    """No level, no source: a toy may have any size and posture."""
    files = [swap("cohort.yaml", "[L4, L3, L2]", "[V4, V3, V2]")]
    folder = write_small(tmp_path / "small", *files)
    for file in folder.glob("*.csv"):
        renamed = file.read_text().replace("L", "V")
        file.write_text(renamed)
    scale(folder / "landmarks.csv", list(XYZ), 3.0)
    assert not [one for one in suspicions(cohorts.read(folder)) if one.group == "postures"]
    assert not [one for one in suspicions(cohorts.read(folder)) if one.certain]


def scale(file: Path, columns: list[str], factor: float) -> None:
    table = pd.read_csv(file)
    table[columns] = np.asarray(table[columns], dtype=float) * factor
    table.to_csv(file, index=False)
