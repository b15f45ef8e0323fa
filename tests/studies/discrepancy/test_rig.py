"""A machine that moves a joint and measures its load: read, fitted and told as what it is.

The data are made by one line of algebra, F = k q (1 + c q^2), with all rotations blocked.
"""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import Accuracy
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies import read as studies
from spinepipe.studies.discrepancy.checks import check_discrepancy
from spinepipe.studies.discrepancy.rows import _as_load
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.investigation import (
    Investigation,
    Prepared,
    fit_base,
    investigate,
    prepare,
)
from spinepipe.studies.discrepancy.search.regions import values_with_regions
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import VerdictKind

STEPS_MM = np.array([0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 1.4, 0.6])
STIFFNESS, FORCE_SD, MOTION_SD = 6e4, 1.0, 0.02
"""N/m, N and mm."""

YAML = """\
cohort: rig
title: a joint that a machine shears
source: made up
vertebrae: [C7, C6]
gravity: false
measurement_sd: {rotation_deg: 0.1, translation_mm: 0.02, force_n: 1.0}
accuracy: {rotation_deg: 0.001, translation_mm: 0.0002, force_n: 0.01}
"""
SUPPORTS = """\
specimen,test,joint,coordinate,state,reaction
*,*,*,anterior,prescribed,measured
*,*,*,extension,held,
*,*,*,right_bending,held,
*,*,*,left_rotation,held,
"""
STUDY = Discrepancy(
    study="rig", kind="discrepancy", cohort="rig", base={"stiffness": "per_specimen"}
)


def force(q_mm: np.ndarray, growth_per_mm2: float) -> np.ndarray:
    return STIFFNESS * q_mm * 1e-3 * (1.0 + growth_per_mm2 * q_mm**2)


def written(
    folder: Path, growth_per_mm2: float, noise_n: float = 0.0, specimens: str = "a"
) -> tuple[Cohort, np.ndarray]:
    """The cohort, and the forces (specimens x tests, T) N that its machine measured."""
    rng = np.random.default_rng(5)
    folder = folder / "rig"
    folder.mkdir()
    loads = ["specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm"]
    motion = ["specimen,test,step,joint,anterior_mm,superior_mm,right_mm"]
    forces = []
    for name, (test, side) in product(specimens, (("anterior", 1.0), ("posterior", -1.0))):
        q = side * STEPS_MM
        measured = force(q, growth_per_mm2) + noise_n * rng.normal(size=len(q))
        forces.append(measured)
        for step, (f, at) in enumerate(zip(measured, q, strict=True)):
            loads.append(f"{name},{test},{step},C6,{f:.12g},0,0,0,0,0,0,0,0")
            motion.append(f"{name},{test},{step},C6C7,{at:g},0,0")
    (folder / "cohort.yaml").write_text(YAML)
    (folder / "specimens.csv").write_text("\n".join(["specimen", *specimens]) + "\n")
    header = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    poses = [f"{name},C6C7,0,0,0,0,0,0" for name in specimens]
    (folder / "joints.csv").write_text("\n".join([header, *poses]) + "\n")
    (folder / "loads.csv").write_text("\n".join(loads) + "\n")
    (folder / "motion.csv").write_text("\n".join(motion) + "\n")
    (folder / "supports.csv").write_text(SUPPORTS)
    return cohorts.read(folder), np.array(forces)


def laid(cohort: Cohort) -> tuple[Prepared, BaselineFit]:
    ready = prepare(STUDY, cohort, None)
    return ready, fit_base(ready, at_once)


def test_a_study_says_before_its_cohort_how_large_the_noise_is(tmp_path: Path) -> None:
    """Translations first; where neither says it, it is not known."""
    cohort = written(tmp_path, 0.0)[0]
    sd = {"rotation_deg": 0.2, "translation_mm": 0.5}
    own = Discrepancy.model_validate(STUDY.model_dump() | {"measurement_sd": sd})
    for study, mm, deg in ((STUDY, 0.02, 0.1), (own, 0.5, 0.2)):
        expected = [1e-3 * mm] * 3 + [np.deg2rad(deg)] * 3
        assert prepare(study, cohort, None).declared == pytest.approx(expected)
    assert (
        prepare(STUDY, replace(cohort, measurement_sd=None, accuracy=None), None).declared is None
    )


def test_an_accuracy_beside_a_stated_scatter_counts_once(tmp_path: Path) -> None:
    """A scatter that was made as large as it would count it in every reading once more."""
    cohort = replace(written(tmp_path, 0.0)[0], accuracy=Accuracy(translation_mm=0.3))
    noise = prepare(STUDY, cohort, None).noise
    assert noise.sd[0] == pytest.approx(1.2 * 0.02e-3)  # the cohort's, doubted by a fifth
    assert noise.accuracy[0] == pytest.approx(0.3e-3)


def test_what_is_read_and_what_is_not(tmp_path: Path) -> None:
    ready = prepare(STUDY, written(tmp_path, 0.0)[0], None)
    assert ready.coordinates == ("anterior", "superior", "right")
    for test in ready.readings[0].tests:
        assert (test.cycles[..., 0] == 0.0).all()  # reactions: none is needed beside what is listed
        assert np.isnan(test.cycles[..., 3:]).all()
        assert test.case.fixed == [0, 3, 4, 5]


@sweep("noise_n, within", [(0.0, 1e-3), (FORCE_SD, 4.0)])
def test_the_base_has_the_stiffness_that_made_the_forces(
    noise_n: float, within: float, tmp_path: Path
) -> None:
    """Of reactions k q - F with one SD each, the SD of k is that of F over the root of sum q^2."""
    cohort, _ = written(tmp_path, 0.0, noise_n)
    _, grounds = laid(cohort)
    found = grounds.fit.models["a"].effects[0].values[0, 0]
    sd = FORCE_SD / np.sqrt(2.0 * (STEPS_MM**2).sum()) * 1e3
    assert abs(found - STIFFNESS) < within * sd


def test_the_law_that_made_the_forces_leaves_noise(tmp_path: Path) -> None:
    cohort, forces = written(tmp_path, 0.0, noise_n=FORCE_SD)
    ready, grounds = laid(cohort)
    stiffness = grounds.fit.models["a"].effects[0].values[0, 0]
    q = np.array([STEPS_MM, -STEPS_MM]) * 1e-3
    for number, predicted in enumerate(grounds.fit.predicted["a"]):
        order = [test.case.test for test in ready.readings[0].tests]
        row = 0 if order[number] == "anterior" else 1
        in_newton = predicted[:, 0, 0] / (MOTION_SD * 1e-3) * FORCE_SD
        np.testing.assert_allclose(in_newton, stiffness * q[row] - forces[row], atol=1e-6)


def test_rows_of_a_rig_are_loads(tmp_path: Path) -> None:
    """Measured is what is listed; the model's is what it holds where the machine has the joint."""
    cohort, _ = written(tmp_path, 0.0)
    (first, *_) = prepare(STUDY, cohort, None).readings[0].tests
    step = first.case.steps[3]
    rig = next(one for one in step.supports if one.place == 0)
    assert rig.read_as is not None
    held, listed = 50.0, float(step.wrenches[0].force[0])
    reading_mm = (held - listed) * rig.read_as * 1e3
    row = {"load": listed, "measured": 0.0, "base": reading_mm, "with_effects": reading_mm}
    row["with_table"] = None
    row["noise_sd"] = MOTION_SD
    told = _as_load(rig, row, 0)
    assert told["unit"] == "N"
    assert told["measured"] == listed
    assert told["base"] == pytest.approx(held, rel=1e-12)
    assert told["noise_sd"] == pytest.approx(FORCE_SD, rel=1e-12)
    assert told["held_at"] == pytest.approx(1.2 if first.case.test == "anterior" else -1.2)


def test_sds_of_loads_and_motion_stand_together(tmp_path: Path) -> None:
    cohort, _ = written(tmp_path, 0.0)
    document = YamlDocument("config/studies/rig.yaml", {}, {})
    assert list(check_discrepancy(document, STUDY, cohort)) == []
    own = STUDY.model_copy(update={"measurement_sd": cohort.measurement_sd})
    (problem,) = check_discrepancy(document, own, cohort)
    assert "set measurement_sd in cohort.yaml" in str(problem)


def test_kinds_that_know_no_rig_refuse_the_cohort(tmp_path: Path) -> None:
    cohort, _ = written(tmp_path, 0.0)
    folder = tmp_path / "config" / "studies"
    folder.mkdir(parents=True)
    (folder / "bent.yaml").write_text(
        f"study: bent\nkind: cohort_stiffness\ncohort: {cohort.folder}\n"
    )
    with pytest.raises(InputError) as caught:
        studies.check(tmp_path, "bent")
    told: list[InputProblem] = [p for p in caught.value.problems if "supports.csv" in p.found]
    assert len(told) == 1
    assert "discrepancy" in told[0].allowed


def searched(folder: Path, growth_per_mm2: float) -> Investigation:
    """A search among a few effects for what the machine's forces show."""
    cohort, _ = written(folder, growth_per_mm2, FORCE_SD, "abcd")
    few = ("nonlinear_stiffening", "neutral_zone", "flexion_extension_asymmetry")
    study = STUDY.model_copy(update={"effects": few})
    return investigate(prepare(study, cohort, None), at_once)


def test_stiffening_that_a_machine_measures_as_force_is_named(tmp_path: Path) -> None:
    """With the growth that made the forces, 0.15 per mm2, in its interval."""
    found = searched(tmp_path, 0.15)
    assert found.ended.verdict is VerdictKind.NAMED
    (standing,) = found.ended.named
    assert standing.name == "nonlinear_stiffening"
    assert dict(standing.supposed.form.variant.options)["coordinate"] == "anterior"
    final = found.found.final
    growth = next(v for v in values_with_regions(final.fit, final.setting, 0) if v.name == "growth")
    assert growth.unit == "1/m^2"
    assert growth.low < 0.15e6 < growth.high
    assert growth.high - growth.low < 0.1 * growth.value


def test_a_machine_that_measures_a_straight_line_shows_nothing(tmp_path: Path) -> None:
    assert searched(tmp_path, 0.0).ended.verdict is VerdictKind.NULL
