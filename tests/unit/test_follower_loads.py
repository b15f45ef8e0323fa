"""Follower loads of a cohort and of virtual tests, where their motion is known in closed form.

A cable through the centres of coaxial joints presses each of them by its tension and turns none.

Catches a follower load that presses otherwise than its cable would.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_cases import JOINTS, STUDY, Chains, by_joint

from spinepipe import cohort as cohorts
from spinepipe.cohort.specimen import followers
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.specimen import view_of
from spinepipe.report.specimen_text import describe
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

ROTATED = "left_axial_rotation"
TENSION_N = 400.0
SUPERIOR_N_PER_M = np.array([1.0e6, 1.5e6, 2.0e6])
A = np.array([[50.0, 60.0, 200.0], [55.0, 66.0, 220.0], [60.0, 70.0, 240.0]])
FREE = "free: [left_rotation, superior]\n"


def pressed(zeroed: bool = False, **changed: float) -> Chains:
    """One specimen, turned about the axis of its joints under a follower load."""
    chains = Chains({"a": A}, [ROTATED], zeroed=zeroed, study=FREE)
    chains.loads["follower_n"] = changed.get("follower_n", TENSION_N)
    shortening = dict(zip(JOINTS, 1000.0 * TENSION_N / SUPERIOR_N_PER_M, strict=True))
    chains.motion["superior_mm"] = 0.0 if zeroed else -chains.motion["joint"].map(shortening)
    return chains


def test_stiffness_that_only_the_cable_loads_is_its_tension_over_the_shortening(
    tmp_path: Path,
) -> None:
    found = pressed().write(tmp_path).fit("a", "per_joint")
    known = by_joint(found["stiffness"], "identifiable")
    assert known[["left_rotation", "superior"]].all(axis=None)
    values = by_joint(found["stiffness"])
    np.testing.assert_allclose(values["superior"], SUPERIOR_N_PER_M, rtol=1e-6)
    np.testing.assert_allclose(values["left_rotation"], A[:, 2], rtol=1e-6)
    assert (found["errors"]["rmse"] < 1e-9).all()


def test_a_cable_that_acts_in_step_0_already_tells_nothing_once_that_is_subtracted(
    tmp_path: Path,
) -> None:
    found = pressed(zeroed=True).write(tmp_path).fit("a", "per_joint")["stiffness"]
    assert by_joint(found, "identifiable")["left_rotation"].all()
    assert not by_joint(found, "identifiable")["superior"].any()
    np.testing.assert_allclose(by_joint(found)["left_rotation"], A[:, 2], rtol=1e-6)


def test_a_test_without_a_cable_is_not_pressed(tmp_path: Path) -> None:
    """Of two tests one has a cable: readings of both are met, with the same stiffness."""
    chains = pressed()
    free = chains.loads.assign(test="free rotation", follower_n=np.nan)
    read = chains.motion.assign(test="free rotation", superior_mm=0.0)
    chains.loads = pd.concat([chains.loads, free], ignore_index=True)
    chains.motion = pd.concat([chains.motion, read], ignore_index=True)
    found = chains.write(tmp_path).fit("a", "per_joint")
    np.testing.assert_allclose(by_joint(found["stiffness"])["superior"], SUPERIOR_N_PER_M, 1e-6)
    assert (found["errors"]["rmse"] < 1e-9).all()


def test_the_specimen_s_text_tells_it(tmp_path: Path) -> None:
    pressed().write(tmp_path)
    study, cohort = study_of_kind(CohortStiffness, str(tmp_path), STUDY)
    assert followers(cohort, "a") == {ROTATED: TENSION_N}
    told = describe(cohort, view_of(cohort, "a", study.tests))
    assert f"follower   400 N in {ROTATED}" in told


# --- what is refused ------------------------------------------------------------------------------


def problems(folder: Path, chains: Chains) -> tuple[InputProblem, ...]:
    chains.write(folder)
    with pytest.raises(InputError) as caught:
        cohorts.read(folder / "config" / "cohorts" / "chains")
    return caught.value.problems


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        ([400.0, 400.0, 300.0, 400.0], "300 N after 400 N in test 'left_axial_rotation'"),
        ([400.0, np.nan, 400.0, 400.0], "no follower load after 400 N"),
    ],
)
def test_a_test_has_one_tension(cells: list[float], found: str, tmp_path: Path) -> None:
    chains = pressed()
    chains.loads["follower_n"] = cells
    (problem,) = problems(tmp_path, chains)
    assert found in problem.found
    assert (problem.row, problem.column) == (2 + np.argmax(np.array(cells) != 400.0), "follower_n")


def test_rows_for_all_and_rows_of_one_specimen_have_the_same(tmp_path: Path) -> None:
    chains = pressed()
    chains.loads = pd.concat(
        [chains.loads, chains.loads.assign(specimen="*", vertebra="L4", follower_n=100.0)]
    )
    (problem,) = problems(tmp_path, chains)
    assert problem.column == "follower_n"


@pytest.mark.parametrize("tension", [-1.0, 2001.0])
def test_tensions_of_no_cable_are_refused(tension: float, tmp_path: Path) -> None:
    assert {one.column for one in problems(tmp_path, pressed(follower_n=tension))} == {"follower_n"}
