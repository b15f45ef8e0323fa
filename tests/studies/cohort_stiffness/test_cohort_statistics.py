"""Tests of significance of a cohort study: numbers worked by hand."""

import pandas as pd
import pytest
from cohort_analysis_cases import Row, fit, only, seen, statistics_of
from scipy import stats

from spinepipe.studies.cohort_stiffness.significance import nested_fits
from spinepipe.studies.cohort_stiffness.stages import of_joint_fits
from spinepipe.units import ROTATIONS


def test_groups_of_errors() -> None:
    errors = {("a", "L4L5"): 1.0, ("b", "L4L5"): -3.0, ("c", "L4L5"): 5.0}
    errors |= {("a", "L5S1"): -2.0, ("b", "L5S1"): 4.0, ("c", "L5S1"): 6.0}
    found = statistics_of(seen(*place, error) for place, error in errors.items())
    of = {"family": "between_specimens/per_specimen/fitted", "response": "loaded_error"}
    kruskal = only(found, test="Kruskal-Wallis", **of)
    # Rank sums 3, 7 and 11: 12 / 42 x (9 + 49 + 121) / 2 - 21.
    assert kruskal["statistic"] == pytest.approx(12 / 42 * 179 / 2 - 21)
    assert (kruskal["n"], kruskal["stratum"], kruskal["factor"]) == (6, "flexion", "specimen")
    assert "as published" in kruskal["message"]
    # Two blocks of the same order, rank sums 2, 4 and 6: 12 / 24 x 56 - 24.
    paired = only(found, test="Friedman", **of)
    assert (paired["statistic"], paired["n"]) == (pytest.approx(4.0), 2)
    levels = found[found["family"] == "between_levels/per_specimen/fitted"]
    assert set(levels[levels["test"] == "Friedman"]["status"]) == {"too_few"}  # of two joints


def test_blocks_with_a_gap_are_left_out_and_counted() -> None:
    errors = [seen(s, j, 1.0 + i) for i, s in enumerate("abc") for j in ("L3L4", "L4L5", "L5S1")]
    errors[0]["peak_error"] = None
    of = {"family": "between_specimens/per_specimen/fitted", "response": "loaded_error"}
    found = only(statistics_of(errors), test="Friedman", **of)
    assert (found["n"], found["statistic"]) == (2, pytest.approx(4.0))
    assert "1 incomplete blocks of a coordinate left out" in found["message"]


def test_coordinates_of_one_joint_are_one_block() -> None:
    """Three coordinates that say the same are no three times as many blocks."""
    errors = [
        seen(specimen, joint, size * error, coordinate=c, loaded=c == "extension")
        for joint, place in (("L4L5", (1.0, 2.0, 3.0)), ("L5S1", (2.0, 1.0, 3.0)))
        for specimen, error in zip("abc", place, strict=True)
        for size, c in zip((1.0, 50.0, -9.0), ROTATIONS, strict=True)
    ]
    of = {"family": "between_specimens/per_specimen/fitted", "response": "rotation_error"}
    found = only(statistics_of(errors), test="Friedman", **of)
    # Ranks 1 2 3 and 2 1 3: sums 3, 3 and 6, 12 / 24 x 54 - 24.
    assert (found["n"], found["statistic"]) == (2, pytest.approx(3.0))


def test_signed_ranks_within_a_specimen() -> None:
    rows = [
        seen(specimen, joint, sign * (error + step), name, stage, coordinate=c, loaded=False)
        for specimen in "ab"
        for step, joint in enumerate(("L4L5", "L5S1"))
        for sign, c in zip((1, -1, 1), ROTATIONS, strict=True)
        for name, stage, error in (
            ("literature", "literature", 5.0),
            ("per_specimen", "fitted", 1.0 + step),
        )
    ]
    found = statistics_of(rows)
    family = "signed_rank/literature_against_fitted/per_specimen/flexion"
    row = only(found, family=family, specimen="a")
    # All six pairs fall by the fit: V is the whole rank sum, p one of 2^6 on each side.
    assert (row["statistic"], row["n"], row["effect"]) == (21.0, 6, 1.0)
    assert row["p"] == pytest.approx(2 / 64)
    assert (row["p_bonferroni"], row["family_size"]) == (pytest.approx(4 / 64), 2)
    assert not found["family"].str.contains("left_out").any()  # nothing was held out


def test_level_ratio_against_one_stiffness() -> None:
    rows = [
        seen(specimen, joint, error + place + 0.1 * step, name)
        for place, specimen in enumerate("abcd")
        for step, joint in enumerate(("L4L5", "L5S1"))
        for name, error in (("per_specimen", 1.0), ("level_ratio", 11.0))
    ]
    found = statistics_of(rows)
    of = {"family": "per_specimen_against_level_ratio/flexion", "response": "extension_rmse"}
    kruskal = only(found, test="Kruskal-Wallis", **of)
    # Two groups of four, all of one below the other: 12 / 72 x (100 + 676) / 4 - 27.
    assert kruskal["statistic"] == pytest.approx(12 / 72 * 776 / 4 - 27)
    assert kruskal["p"] == pytest.approx(2 / 70)  # 8 over 4 ways
    paired = only(found, test="Wilcoxon signed rank", **of)
    assert (paired["statistic"], paired["p"]) == (0.0, pytest.approx(2 / 16))
    assert set(found["response"]) >= {"extension_rmse", "overall_rmse"}
    assert "left_rotation_rmse" not in set(found["response"])  # not measured


def test_separate_fits_against_a_joint_one() -> None:
    rows = [fit("all", 30.0, 10), fit("x", 12.0, 5), fit("y", 8.0, 5), fit("all_but_x", 1.0, 5)]
    outcome = nested_fits(pd.DataFrame(rows))
    # One further unknown gains 10 of 30; 20 over 10 - 2 degrees of freedom are left.
    assert outcome.statistic == pytest.approx(4.0)
    assert outcome.effect == pytest.approx(1 / 3)
    assert "F(1, 8)" in outcome.message
    assert outcome.n == 10


def test_unknowns_at_a_bound_are_no_degrees_of_freedom() -> None:
    """54 unknowns of separate fits, two of them at a bound, against 18: 34 further ones."""
    separate = [fit("x", 80.0, 100, 18), fit("y", 90.0, 100, 18, 2), fit("z", 70.0, 100, 18)]
    outcome = nested_fits(pd.DataFrame([fit("all", 285.0, 300, 18), *separate]))
    assert "F(34, 248)" in outcome.message
    assert outcome.statistic == pytest.approx((45.0 / 34.0) / (240.0 / 248.0))
    assert outcome.p == pytest.approx(stats.f.sf(outcome.statistic, 34, 248))
    assert outcome.n == 300


def test_separate_fits_all_at_bounds_are_no_larger_model() -> None:
    rows = [fit("all", 30.0, 10, 2), fit("x", 12.0, 5, 2, 1), fit("y", 8.0, 5, 2, 1)]
    outcome = nested_fits(pd.DataFrame(rows))
    assert outcome.p is None
    assert "no more unknowns inside their bounds" in outcome.message


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([fit("x", 1.0, 5)], "one load case"),
        ([fit("all", 1.0, 5), fit("x", 1.0, 5), fit("y", None, 0)], "one load case"),
        ([fit("all", 1.0, 10), fit("x", 1.0, 5), fit("y", None, 5)], "missing"),
        ([fit("all", None, 10), fit("x", 1.0, 5), fit("y", 1.0, 5)], "missing"),
        ([fit("all", 1.0, 10), fit("x", 1.0, 5), fit("y", 1.0, 4)], "same readings"),
    ],
)
def test_fits_that_cannot_be_compared(rows: list[Row], told: str) -> None:
    outcome = nested_fits(pd.DataFrame(rows))
    assert outcome.p is None
    assert told in outcome.message


def test_the_joint_fit_of_several_load_cases_is_not_that_to_one_of_them() -> None:
    """Also where the joint fits have left no errors: the tests tell that there are several."""
    rows = [seen("a", "L5S1", 1.0, test=test, fitted_to="flexion") for test in ("flexion", "bend")]
    assert of_joint_fits(pd.DataFrame(rows), "fitted").empty
    folds = [seen("a", "L5S1", 1.0, fitted_to="all_but_bend")]
    assert of_joint_fits(pd.DataFrame(folds), "fitted").empty


def test_folds_that_failed_are_not_those_of_two_load_cases() -> None:
    """Of three load cases, two of which are read in rotations, the fit to one is no fold."""
    rows = [
        seen("a", "L5S1", 1.0, stage="left_out_case", test=test, fitted_to=label)
        for test in ("flexion", "bend")
        for label in ("flexion", "bend", "pull", "all")
        if label not in (test, "all")
    ]
    assert of_joint_fits(pd.DataFrame(rows), "left_out_case").empty


def test_a_representation_without_errors_under_one_test() -> None:
    rows = [
        seen(specimen, joint, 1.0 + place, name, test=test, fitted_to=test, coordinate=c)
        for place, specimen in enumerate("abcd")
        for joint in ("L4L5", "L5S1")
        for name in ("per_specimen", "level_ratio")
        for test in ("flexion", "bend")
        for c in ROTATIONS
        if (name, test) != ("level_ratio", "bend")
    ]
    found = statistics_of(rows)["family"]
    families = found[found.str.startswith("per_specimen_against_level_ratio")]
    assert set(families) == {"per_specimen_against_level_ratio/flexion"}


def test_more_unknowns_than_readings_are_too_few() -> None:
    rows = [fit("all", 1.0, 20, 9), fit("x", 0.0, 10, 12), fit("y", 0.0, 10, 12)]
    fits = pd.DataFrame(rows)
    found = statistics_of([seen("a", "L5S1", 1.0)], fits)
    row = only(found, family="load_case_specific/per_joint")
    assert (row["status"], row["n"]) == ("too_few", 0)
    assert "-4 degrees of freedom" in row["message"]
