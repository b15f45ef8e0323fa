"""Errors of representations and their order: numbers worked by hand."""

import pandas as pd
import pytest
from cohort_analysis_cases import fit, only, seen, series

from spinepipe.studies.cohort_stiffness.mae import mae_rows
from spinepipe.studies.cohort_stiffness.ranking import SPREADS, rank_candidates, ranking_rows
from spinepipe.studies.cohort_stiffness.stages import of_joint_fits, of_single_cases, specimen_rms
from spinepipe.studies.cohort_stiffness.tables import MAE
from spinepipe.tables import from_rows


def test_mae_is_over_joints_and_then_over_specimens() -> None:
    rows = [
        seen("a", "L4L5", 1.0, mae=0.5, measured_peak=-10.0),
        seen("a", "L5S1", -3.0, mae=0.7, measured_peak=-20.0),
        seen("b", "L4L5", 2.0, mae=0.8, measured_peak=8.0, measured=3.0),
        seen("b", "L5S1", 6.0, mae=1.2, measured_peak=8.0, measured=4.0),
        seen("b", "L5S1", 90.0, coordinate="left_rotation", loaded=False),
    ]
    found = mae_rows(pd.DataFrame(rows))
    peak, every = from_rows(MAE, found).to_pylist()
    # Per specimen 2 and 4 deg; the mean motions are 15 and 8 deg.
    assert [peak[name] for name in ("low_quartile", "mae", "high_quartile")] == [*(2.5, 3.0, 3.5)]
    assert (peak["steps"], peak["specimens"], peak["largest_motion"]) == ("peak", 2, 15.0)
    assert peak["mae_percent"] == pytest.approx(20.0)
    # Per specimen 0.6 and 1.0 deg; the mean motions are 5 and 3.5 deg.
    assert every["mae"] == pytest.approx(0.8)
    assert every["mae_percent"] == pytest.approx(16.0)


def test_mae_leaves_out_what_was_lost_or_not_measured() -> None:
    rows = [
        seen("a", "L4L5", 2.0),
        seen("a", "L5S1", None, measured_peak=None),  # not read at the largest load
        seen("b", "L4L5", 9.0),
        seen("b", "L5S1", None),  # no pose was found
        seen("b", "L5S1", None, representation="per_joint", measured_peak=40.0),
    ]
    peaks = [row for row in mae_rows(pd.DataFrame(rows)) if row["steps"] == "peak"]
    assert [(row["specimens"], row["mae"]) for row in peaks] == [(1, 2.0), (0, None)]
    from_rows(MAE, peaks)


def test_rms_is_weighted_by_readings_and_only_of_complete_specimens() -> None:
    errors = pd.DataFrame(
        [
            seen("a", "L4L5", 1.0, readings=3),
            seen("a", "L5S1", 3.0, readings=1),
            seen("b", "L4L5", 1.0),
            seen("b", "L5S1", None),
            seen("c", "L4L5", 1.0),
            seen("c", "L5S1", 1.0, representation="per_joint"),
            seen("a", "L5S1", 7.0, coordinate="right", readings=100),
        ]
    )
    found = specimen_rms(errors[errors["representation"] == "per_specimen"], errors)
    assert found.to_dict() == pytest.approx({"a": 3.0**0.5})  # (3 x 1 + 1 x 9) / 4


def test_stages_take_the_fits_that_tell_of_them() -> None:
    labels = ["flexion", "twist", "bend", "all", "all_but_flexion", "all_but_twist"]
    three = pd.DataFrame(
        seen("a", "L5S1", 1.0, stage=stage, test=test, fitted_to=label)
        for test in ("flexion", "twist", "bend")
        for stage in ("fitted", "left_out_case")
        for label in labels
    )
    joint = of_joint_fits(three, "left_out_case")
    assert list(zip(joint["test"], joint["fitted_to"], strict=True)) == [
        ("flexion", "all_but_flexion"),
        ("twist", "all_but_twist"),
    ]
    assert set(of_joint_fits(three, "fitted")["fitted_to"]) == {"all"}
    single = of_single_cases(three, "fitted")
    assert (single["test"] == single["fitted_to"]).all()
    assert len(single) == 3
    two = three[(three["test"] != "bend") & three["fitted_to"].isin(["flexion", "twist", "all"])]
    other = of_joint_fits(two, "left_out_case")
    assert list(zip(other["test"], other["fitted_to"], strict=True)) == [
        ("flexion", "twist"),
        ("twist", "flexion"),
    ]
    one = two[(two["test"] == "twist") & (two["fitted_to"] == "twist")]
    assert len(of_joint_fits(one, "fitted")) == 1


def test_means_are_ranked_and_told_from_the_best() -> None:
    found = {
        ("level_ratio", "own"): series(3.0, 4.0, 5.0, 6.0, 7.0, 8.0),
        ("per_joint", "own"): series(1.0, 1.0, 3.0, 3.0, 5.0, 5.0),
    }
    best, worse = rank_candidates(found, summed=False)
    assert (best["representation"], best["rank"], best["value"]) == ("per_joint", 1, 3.0)
    assert (best["worse_than_best"], best["p"]) == (0.0, None)
    # Differences 2 3 2 3 2 3: mean 2.5, SD sqrt(0.3), all of one sign among 2^6.
    assert worse["worse_than_best"] == pytest.approx(2.5)
    assert worse["worse_standard_error"] == pytest.approx((0.3 / 6) ** 0.5)
    assert worse["p"] == pytest.approx(2 / 64)


def test_sums_are_ranked() -> None:
    found = {("a", "own"): series(10.0, 20.0), ("b", "own"): series(12.0, 24.0)}
    best, worse = rank_candidates(found, summed=True)
    assert (best["value"], best["unit"], worse["value"]) == (30.0, "", 36.0)
    # Differences 2 and 4, SD sqrt(2): the sum of two has SE 2.
    assert (worse["worse_than_best"], worse["p"]) == (6.0, None)
    assert worse["worse_standard_error"] == pytest.approx(2.0)
    assert "no p for information criteria" in worse["message"]


def test_no_p_for_a_sum_however_clear_it_is() -> None:
    found = {("a", "own"): series(*range(6)), ("b", "own"): series(*range(10, 16))}
    assert [row["p"] for row in rank_candidates(found, summed=True)] == [None, None]
    assert rank_candidates(found, summed=False)[1]["p"] == pytest.approx(2 / 64)


def test_spreads_of_the_cohort_count_once_in_its_criteria() -> None:
    """Two specimens of 50 readings; 5 of 6 spreads told: + 2 x 5, and + 5 ln 100."""
    fits = pd.DataFrame(
        fit("all", cost, 50) | {"specimen": specimen, "representation": name}
        for name, costs in (("partially_pooled", (10.0, 20.0)), ("per_joint", (12.0, 22.0)))
        for specimen, cost in zip("ab", costs, strict=True)
    )
    fits = pd.concat([fits, fits.assign(fitted_to="x"), fits.assign(fitted_to="y")])
    pooling = pd.DataFrame(
        {
            "representation": "partially_pooled",
            "fitted_to": label,
            "without": who,
            "coordinate": c,
            "between_levels": level,
            "between_specimens": 0.2,
            "between_joints": 0.1,
            **dict.fromkeys(SPREADS[3:]),  # of growth, in fits that stiffen alone
        }
        for label in ("all", "x")
        for who in ("nobody", "a")
        for c, level in (("extension", 0.1), ("right_bending", None))
    )
    errors = pd.DataFrame([seen("a", "L5S1", 1.0)])
    table = pd.DataFrame(ranking_rows(errors, fits, pooling))
    aicc = only(table, criterion="aicc", representation="partially_pooled")
    bic = only(table, criterion="bic", representation="partially_pooled")
    assert aicc["value"] == pytest.approx(40.0)
    assert bic["value"] == pytest.approx(30.0 + 5 * 4.60517)
    assert "5 spreads" in aicc["message"]
    # The order turns: 30 against 34 without them. Differences 2 and 2, 3 more each.
    assert (aicc["rank"], aicc["worse_than_best"]) == (2, pytest.approx(6.0))
    assert only(table, criterion="aicc", representation="per_joint")["value"] == 34.0


def test_only_specimens_with_all_results_are_compared() -> None:
    found = {
        ("a", "own"): series(1.0, 2.0, 9.0),
        ("b", "own"): series(3.0, 3.0),
        ("c", "own"): series(),
    }
    first, second, none = rank_candidates(found, summed=False)
    assert (first["value"], first["specimens"]) == (1.5, 2)
    assert "left out, without a result: c (b)" in first["message"]
    assert (second["value"], second["rank"]) == (3.0, 2)
    assert (none["value"], none["rank"], none["specimens"]) == (None, None, 0)
    assert none["message"]


def test_nobody_has_all_results() -> None:
    found = {("a", "own"): series(1.0), ("b", "own"): series(2.0, names="z")}
    assert [row["rank"] for row in rank_candidates(found, summed=False)] == [None, None]
