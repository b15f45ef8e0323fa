"""Mistakes in the files are suspected where they are, and nowhere else whatever the physics."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import spring_chain_cases as chains
from spring_chain_cases import JOINTS, SD, THERE_AND_BACK, Array, Yield, changed, readings
from sweeps import sweep

from spinepipe.cohort import read
from spinepipe.model import LoadStep
from spinepipe.studies.discrepancy.mistakes.data_errors import before_a_fit, suspected_errors
from spinepipe.studies.discrepancy.mistakes.swapped_specimens import swapped_pairs
from spinepipe.studies.discrepancy.search.baseline import (
    BaselineFit,
    BaselineModels,
    base_model,
    base_parameters,
    fit_baseline,
)
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings, specimen_readings
from spinepipe.studies.discrepancy.search.search_state import look
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import SuspectedError
from spinepipe.units import ROTATIONS
from tests.generators.hidden import Hidden, Recipe, make

SDS = np.array([np.nan] * 3 + [SD] * 3)


def suspected(
    given: Sequence[SpecimenReadings], zeroed: bool = False
) -> tuple[SuspectedError, ...]:
    return before_a_fit(given, JOINTS, SDS, zeroed=zeroed)


def noise(zeroed: bool = False) -> Noise:
    return Noise(SDS, 0.0, "declared", np.zeros(6, dtype=np.int64), 0, zeroed)


def grounds(given: Sequence[SpecimenReadings], grouping: str = "per_specimen") -> BaselineFit:
    return fit_baseline(given, noise(), NuisancePriors(), chains.start(given, grouping), at_once)


# Laws that are physics -----------------------------------------------------------------------


def stiffening(joint: int, moments: Array, k: float) -> Array:
    """k x (1 + (x / 3 deg)^2) = M, inverted on a fine grid."""
    x = np.linspace(-0.5, 0.5, 20001)
    return np.interp(moments, k * x * (1.0 + (x / np.deg2rad(3.0)) ** 2), x)


def neutral_zone(joint: int, moments: Array, k: float) -> Array:
    """3 deg to either side at a tenth of the stiffness, then the whole."""
    inside = np.clip(moments / (0.1 * k), -np.deg2rad(3.0), np.deg2rad(3.0))
    return inside + (moments - 0.1 * k * inside) / k


def neutral_zone_of_one(joint: int, moments: Array, k: float) -> Array:
    return neutral_zone(joint, moments, k) if joint == 1 else moments / k


def asymmetry(joint: int, moments: Array, k: float) -> Array:
    return moments / np.where(moments > 0.0, k, 4.0 * k)


def laxity(joint: int, moments: Array, k: float) -> Array:
    return moments / (0.3 * k if joint == 2 else k)


def stop(joint: int, moments: Array, k: float) -> Array:
    """Twenty times as stiff beyond 2 deg to one side, one joint."""
    x = moments / k
    gap = np.deg2rad(2.0)
    return np.where((x > gap) & (joint == 3), gap + (x - gap) / 20.0, x)


def hysteresis(joint: int, moments: Array, k: float) -> Array:
    """Behind its load by what 1.5 N m make."""
    way = np.sign(np.diff(moments, prepend=0.0))
    return (moments - 1.5 * way) / k


LAWS = (chains.linear, stiffening, neutral_zone, neutral_zone_of_one, asymmetry, laxity, stop)


@sweep("law", [*LAWS, hysteresis])
@sweep("zeroed, cycles", [(False, 3), (True, 3), (True, 1)])
def test_nothing_is_suspected_of_clean_data_whatever_the_physics(
    law: Yield, zeroed: bool, cycles: int
) -> None:
    given = readings(0, law, levels=THERE_AND_BACK, zeroed=zeroed, cycles=cycles)
    assert suspected(given, zeroed) == ()


@sweep("law", [chains.linear, neutral_zone_of_one, laxity, stop])
def test_nothing_is_suspected_beside_a_fit_without_repeats(law: Yield) -> None:
    given = readings(4, law, cycles=1)
    assert suspected_errors(grounds(given), given) == ()


# Signs ---------------------------------------------------------------------------------------


def flip(specimens: Sequence[str], joint: int, coordinate: int, tests: Sequence[str] = ()):
    def change(specimen: str, test: str, cycles: Array) -> Array:
        new = cycles.copy()
        if specimen in specimens and (not tests or test in tests):
            new[..., joint, coordinate] *= -1.0
        return new

    return change


@sweep("law", [chains.linear, stiffening, laxity])
@sweep("zeroed", [False, True])
def test_a_flipped_coordinate_of_one_joint_is_found(law: Yield, zeroed: bool) -> None:
    given = changed(readings(2, law, zeroed=zeroed), flip("b", 4, 4))
    (error,) = suspected(given, zeroed)
    assert error.where == "b, L1L2 right_bending"
    assert error.what == "sign of the readings"


def test_a_flip_in_all_specimens_is_one_error() -> None:
    (error,) = suspected(changed(readings(2), flip("abc", 0, 5)))
    assert error.where == "all specimens, L5S1 left_rotation"


def test_a_flip_in_one_of_two_tests_names_the_test() -> None:
    given = [
        replace(one, tests=(*one.tests, replace(one.tests[0], case=again(one.tests[0].case))))
        for one in readings(2)
    ]
    (error,) = suspected(changed(given, flip("c", 3, 3, ["flexion again"])))
    assert error.where == "c, L2L3 extension, test flexion again"


def again(case):  # type: ignore[no-untyped-def]
    return replace(case, test=f"{case.test} again")


def test_a_flipped_reading_is_told_even_where_a_free_base_hides_it() -> None:
    """With stiffness free per joint the fit ends at a bound; the sign is told without it."""
    given = changed(readings(2), flip("b", 4, 4))
    (error,) = suspected_errors(grounds(given, "per_joint"), given)
    assert error.where == "b, L1L2 right_bending"


def test_figures_of_a_flip_are_those_of_its_block() -> None:
    """All joints alike: -y fits as noise does, y leaves four times the sum of squares."""
    given = changed(readings(3, cycles=1), flip("a", 2, 3))
    (error,) = suspected(given)
    y = given[0].tests[0].cycles[0, :, 2, 3]
    as_read = float(error.evidence.split("motion ")[-1].split(" ")[0])
    assert as_read == pytest.approx(4.0 * np.sum((y - y.mean()) ** 2) / SD**2, rel=0.05)
    assert float(error.evidence.split(", ")[-1].split(" ")[0]) < 30.0


def test_a_whole_test_with_the_wrong_load_sign_is_found() -> None:
    given = [_turned(one, "bending") if one.specimen == "a" else one for one in readings(2)]
    (error,) = suspected(given)
    assert error.where == "a, test bending"
    assert "sign of the load" in error.what


def _turned(one: SpecimenReadings, test: str, factor: float = -1.0) -> SpecimenReadings:
    """The same readings with other moments in the files."""

    def step(old: LoadStep) -> LoadStep:
        return replace(
            old, wrenches=tuple(replace(w, moment=factor * w.moment) for w in old.wrenches)
        )

    def case(old):  # type: ignore[no-untyped-def]
        return replace(old, steps=tuple(step(s) for s in old.steps))

    return replace(
        one,
        tests=tuple(
            replace(t, case=case(t.case)) if test in ("*", t.case.test) else t for t in one.tests
        ),
    )


# Units ---------------------------------------------------------------------------------------


@sweep(
    "factor, words",
    [(1000.0, "N mm and not N m"), (57.29578, "radians and not degrees"), (1e-3, "kN m and")],
)
def test_a_wrong_unit_everywhere_is_told_by_impossible_stiffness(factor: float, words: str) -> None:
    (error,) = suspected([_turned(one, "*", factor) for one in readings(2)])
    assert error.where == "all specimens"
    assert words in error.what


def test_a_wrong_unit_of_one_specimen_is_told_beside_the_others() -> None:
    given = [_turned(one, "*", 1000.0) if one.specimen == "b" else one for one in readings(2)]
    (error,) = suspected(given)
    assert error.where == "b"
    assert "N mm and not N m" in error.what


def test_a_wrong_unit_of_one_test_is_told_beside_the_other_specimens() -> None:
    given = [
        _turned(one, "rotation", 1000.0) if one.specimen == "c" else one for one in readings(2)
    ]
    (error,) = suspected(given)
    assert error.where == "c, test rotation"


def test_motion_in_radians_taken_for_degrees_is_told() -> None:
    given = changed(readings(2), lambda specimen, test, cycles: np.deg2rad(cycles))
    (error,) = before_a_fit(given, JOINTS, np.deg2rad(SDS), zeroed=False)
    assert error.where == "all specimens"
    assert "radians and not degrees" in error.what


# Markers -------------------------------------------------------------------------------------


def shaken(specimens: Sequence[str], joint: int, factor: float):
    rng = np.random.default_rng(9)

    def change(specimen: str, test: str, cycles: Array) -> Array:
        new = cycles.copy()
        if specimen in specimens:
            more = np.sqrt(factor**2 - 1.0) * SD
            new[..., joint, 3:] += more * rng.standard_normal(new[..., joint, 3:].shape)
        return new

    return change


@sweep("specimens, where", [("b", "b, L3L4"), ("abc", "all specimens, L3L4")])
def test_loose_markers_are_found_by_the_scatter_between_cycles(specimens: str, where: str) -> None:
    (error,) = suspected(changed(readings(3, neutral_zone), shaken(specimens, 2, 8.0)))
    assert (error.where, error.what) == (where, "markers of the joint")


def test_one_of_two_joints_may_have_loose_markers_in_all_specimens() -> None:
    clean = readings(3, joints=2)
    (error,) = before_a_fit(changed(clean, shaken("abc", 1, 8.0)), JOINTS[:2], SDS, zeroed=False)
    assert (error.where, error.what) == ("all specimens, L4L5", "markers of the joint")
    assert before_a_fit(clean, JOINTS[:2], SDS, zeroed=False) == ()


def test_a_joint_that_is_half_as_noisy_again_is_not_suspected() -> None:
    assert suspected(changed(readings(3), shaken("b", 2, 1.5))) == ()


def test_loose_markers_are_found_without_repeats() -> None:
    given = changed(readings(3, cycles=1), shaken("b", 2, 12.0))
    (error,) = suspected_errors(grounds(given), given)
    assert (error.where, error.what) == ("b, L3L4", "markers of the joint")


# Exchanged specimens -------------------------------------------------------------------------


def grounds_of_folder(place: Path) -> BaselineFit:
    cohort = read(place)
    given = [
        specimen_readings(cohort, name, cohort.tests, ROTATIONS) for name in cohort.specimen_names
    ]
    stiffness = np.array([1.5e5, 1.9e6, 1.35e5, *chains.STIFFNESS])
    models = {one.specimen: base_model(cohort, one, stiffness, None) for one in given}
    base = {name: base_parameters(m, "per_specimen", ROTATIONS) for name, m in models.items()}
    return fit_baseline(
        given, noise(), NuisancePriors(), BaselineModels(models, base, 100.0), at_once
    )


def test_an_exchange_that_stiffness_can_hide_is_not_reported() -> None:
    """Upright chains in the same moments: the motion of a is as good for b."""
    a, b, c = readings(2)
    given = [replace(a, tests=b.tests), replace(b, tests=a.tests), c]
    assert swapped_pairs(grounds(given), at_once) == []


@sweep("exchanged", [False, True])
def test_specimens_of_their_own_shape_are_known_again(tmp_path: Path, exchanged: bool) -> None:
    """Data of another simulator, whose specimens differ in axes, masses and load points."""
    mistakes = {"swapped_specimens": {"specimens": [0, 1]}} if exchanged else {}
    make(Recipe(seed=8, errors=mistakes), tmp_path)
    there = grounds_of_folder(tmp_path)
    given = list(there.readings.values())
    assert suspected_errors(there, given) == ()
    found = swapped_pairs(there, at_once)
    assert [(e.where, e.what) for e in found] == [("s01 and s02", "motion exchanged")] * exchanged


def test_an_exchange_is_told_beside_a_real_effect(tmp_path: Path) -> None:
    """Joints that stiffen hide it from chi2 alone, and marker bias of each joint imitates it."""
    mistakes = {"swapped_specimens": {"specimens": [0, 1]}}
    hidden = Hidden("nonlinear_stiffening", "extension", shape={"shape": "tangent"})
    make(Recipe(seed=20501, errors=mistakes, hidden=(hidden,)), tmp_path)
    there = grounds_of_folder(tmp_path)
    tried = trials(("nonlinear_stiffening", "marker_bias"), ROTATIONS, list(there.readings), 6)
    assert look(there, tried).effects[0].log_evidence > 100.0
    found = swapped_pairs(there, at_once, tried)
    assert [(e.where, e.what) for e in found] == [("s01 and s02", "motion exchanged")]
