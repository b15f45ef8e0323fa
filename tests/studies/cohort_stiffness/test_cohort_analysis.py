"""Analyses of a cohort study: numbers worked by hand, and studies with hardly any data."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest

from spinepipe.jobs.tested_rows import corrected_rows
from spinepipe.statistics import mean_of
from spinepipe.studies.cohort_stiffness.claims import Claim, above_zero
from spinepipe.studies.cohort_stiffness.claims_of_errors import (
    OWN_READINGS,
    error_findings,
    every_level,
    overprediction_percent,
)
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import (
    adjusted_share,
    load_case_findings,
    loaded_ratios,
    mean_excess,
    share_between,
    specific,
    stiffness_spreads,
)
from spinepipe.studies.cohort_stiffness.findings import finding_rows
from spinepipe.studies.cohort_stiffness.mae import mae_rows
from spinepipe.studies.cohort_stiffness.ranking import ranked, ranking_rows
from spinepipe.studies.cohort_stiffness.significance import all_tests, nested_fits
from spinepipe.studies.cohort_stiffness.stages import (
    of_joint_fits,
    of_single_cases,
    specimen_rms,
    without_result,
)
from spinepipe.studies.cohort_stiffness.tables import FINDINGS, MAE, RANKING
from spinepipe.tables import from_rows
from spinepipe.tables.shared import STATISTICS
from spinepipe.units import ROTATIONS

CLAIM = Claim("name", "It is so.", "a number", "deg")
NUMBERS = ("bias", "mae", "rmse", "peak_error")
SOURCES = {
    "literature": "literature",
    "fitted": "own",
    "left_out_case": "own",
    "left_out_specimen": "others_median",
}

Row = dict[str, Any]


def seen(
    specimen: str,
    joint: str,
    error: float | None,
    representation: str = "per_specimen",
    stage: str = "fitted",
    test: str = "flexion",
    fitted_to: str = "flexion",
    **more: Any,
) -> Row:
    """A row of ``errors``: the loaded extension, with the same error in every measure."""
    size = None if error is None else abs(error)
    row = {
        **{"specimen": specimen, "representation": representation, "fitted_to": fitted_to},
        **{"source": SOURCES[stage], "stage": stage, "test": test, "joint": joint},
        **{"coordinate": "extension", "loaded": True, "readings": 10, "bias": error},
        **{"mae": size, "rmse": size, "peak_error": error, "measured": 5.0},
        "measured_peak": 10.0,
    }
    return row | more


def statistics_of(errors: Iterable[Row], fits: pd.DataFrame | None = None) -> pd.DataFrame:
    """Table ``statistics`` of such errors."""
    no_fits = pd.DataFrame(columns=["specimen", "representation", "fitted_to", "cost"])
    rows = all_tests(pd.DataFrame(errors), no_fits if fits is None else fits)
    return from_rows(STATISTICS, list(corrected_rows(rows))).to_pandas()


def only(table: pd.DataFrame, **wanted: str) -> pd.Series:
    """The one row with these values."""
    for name, value in wanted.items():
        table = table[table[name] == value]
    assert len(table) == 1
    return table.iloc[0]


# mae


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
    assert [peak[name] for name in ("low_quartile_deg", "mae_deg", "high_quartile_deg")] == [
        *(2.5, 3.0, 3.5)
    ]
    assert (peak["steps"], peak["specimens"], peak["largest_motion_deg"]) == ("peak", 2, 15.0)
    assert peak["mae_percent"] == pytest.approx(20.0)
    # Per specimen 0.6 and 1.0 deg; the mean motions are 5 and 3.5 deg.
    assert every["mae_deg"] == pytest.approx(0.8)
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
    assert [(row["specimens"], row["mae_deg"]) for row in peaks] == [(1, 2.0), (0, None)]
    from_rows(MAE, peaks)


# errors of specimens, stages


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


# ranking


def series(*values: float, names: str = "abcdef") -> pd.Series:
    return pd.Series(values, index=list(names[: len(values)]))


def test_means_are_ranked_and_told_from_the_best() -> None:
    found = {
        ("level_ratio", "own"): series(3.0, 4.0, 5.0, 6.0, 7.0, 8.0),
        ("per_joint", "own"): series(1.0, 1.0, 3.0, 3.0, 5.0, 5.0),
    }
    best, worse = ranked(found, summed=False)
    assert (best["representation"], best["rank"], best["value"]) == ("per_joint", 1, 3.0)
    assert (best["worse_than_best"], best["p"]) == (0.0, None)
    # Differences 2 3 2 3 2 3: mean 2.5, SD sqrt(0.3), all of one sign among 2^6.
    assert worse["worse_than_best"] == pytest.approx(2.5)
    assert worse["worse_standard_error"] == pytest.approx((0.3 / 6) ** 0.5)
    assert worse["p"] == pytest.approx(2 / 64)


def test_sums_are_ranked() -> None:
    found = {("a", "own"): series(10.0, 20.0), ("b", "own"): series(12.0, 24.0)}
    best, worse = ranked(found, summed=True)
    assert (best["value"], best["unit"], worse["value"]) == (30.0, "", 36.0)
    # Differences 2 and 4, SD sqrt(2): the sum of two has SE 2.
    assert (worse["worse_than_best"], worse["p"]) == (6.0, None)
    assert worse["worse_standard_error"] == pytest.approx(2.0)
    assert "no p for information criteria" in worse["message"]


def test_no_p_for_a_sum_however_clear_it_is() -> None:
    found = {("a", "own"): series(*range(6)), ("b", "own"): series(*range(10, 16))}
    assert [row["p"] for row in ranked(found, summed=True)] == [None, None]
    assert ranked(found, summed=False)[1]["p"] == pytest.approx(2 / 64)


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
            "fitted_to": label,
            "without": who,
            "coordinate": c,
            "between_levels": level,
            "between_specimens": 0.2,
            "between_joints": 0.1,
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
    first, second, none = ranked(found, summed=False)
    assert (first["value"], first["specimens"]) == (1.5, 2)
    assert "left out, without a result: c (b)" in first["message"]
    assert (second["value"], second["rank"]) == (3.0, 2)
    assert (none["value"], none["rank"], none["specimens"]) == (None, None, 0)
    assert none["message"]


def test_nobody_has_all_results() -> None:
    found = {("a", "own"): series(1.0), ("b", "own"): series(2.0, names="z")}
    assert [row["rank"] for row in ranked(found, summed=False)] == [None, None]


# statistics


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


def fit(fitted_to: str, cost: float | None, readings: int, unknowns: int = 1) -> Row:
    row = {"specimen": "a", "representation": "per_joint", "fitted_to": fitted_to, "cost": cost}
    return row | {"readings": readings, "unknowns": unknowns, "aicc": cost, "bic": cost}


def test_separate_fits_against_a_joint_one() -> None:
    rows = [fit("all", 30.0, 10), fit("x", 12.0, 5), fit("y", 8.0, 5), fit("all_but_x", 1.0, 5)]
    outcome = nested_fits(pd.DataFrame(rows))
    # One further unknown gains 10 of 30; 20 over 10 - 2 degrees of freedom are left.
    assert outcome.statistic == pytest.approx(4.0)
    assert outcome.effect == pytest.approx(1 / 3)
    assert "F(1, 8)" in outcome.message


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


# findings


def test_the_sign_of_a_mean_decides_if_it_is_sure() -> None:
    # Mean 2, SE 1 / sqrt(3), Student's t of 2 degrees of freedom 4.302653.
    unsure = above_zero(CLAIM, series(1.0, 2.0, 3.0), 0.05)
    reach = 4.302653 / 3.0**0.5
    assert (unsure["value"], unsure["holds"]) == (2.0, "undecided")
    assert [unsure["low"], unsure["high"]] == pytest.approx([2.0 - reach, 2.0 + reach])
    assert unsure["p"] == pytest.approx(0.0742, abs=5e-5)  # t = 3.4641
    assert above_zero(CLAIM, series(3.0, 4.0, 5.0), 0.05)["holds"] == "yes"
    assert above_zero(CLAIM, series(-3.0, -4.0, -5.0), 0.05)["holds"] == "no"
    assert above_zero(CLAIM, series(3.0, 4.0, 5.0), 0.001)["holds"] == "undecided"


@pytest.mark.parametrize(("values", "value"), [((), None), ((3.0,), 3.0), ((2.0, 2.0), 2.0)])
def test_what_has_no_interval_is_undecided(values: tuple[float, ...], value: float | None) -> None:
    row = above_zero(CLAIM, series(*values), 0.05)
    assert (row["value"], row["low"], row["p"], row["holds"]) == (value, None, None, "undecided")
    assert row["message"]


RATINGS = ((9, 2, 5, 8), (6, 1, 3, 2), (8, 4, 6, 8), (7, 1, 2, 6), (10, 5, 6, 9), (6, 2, 4, 7))
"""Shrout and Fleiss 1979, doi:10.1037/0033-2909.86.2.420, Table 2: six targets, four judges."""


def stiff(specimen: str, joint: str, log: float, **more: Any) -> Row:
    row: Row = {"specimen": specimen, "joint": joint, "coordinate": "extension", "source": "own"}
    row |= {"representation": "per_joint", "fitted_to": "all", "stiffness": np.exp(log)}
    row |= {"standard_error": 0.1 * np.exp(log), "identifiable": True, "at_bound": "no"}
    return row | more


def rated() -> list[Row]:
    return [
        stiff(name, joint, float(rating))
        for name, ratings in zip("abcdef", RATINGS, strict=True)
        for joint, rating in zip(("L2L3", "L3L4", "L4L5", "L5S1"), ratings, strict=True)
    ]


def test_the_share_between_specimens_is_the_intraclass_correlation() -> None:
    row = share_between(CLAIM, pd.DataFrame(rated()), "specimen", "joint", 0.05, "")
    # Their mean squares: 11.24 between targets, 1.02 residual; ICC(3,1) 0.71.
    assert row["value"] == pytest.approx(0.71, abs=0.005)
    assert row["message"] == "F(5, 15) 11"
    # R package psych, ICC(): ICC3 of these ratings, lower bound 0.34, upper bound 0.95.
    assert row["low"] == pytest.approx(0.34, abs=0.005)
    assert row["high"] == pytest.approx(0.95, abs=0.005)
    assert row["holds"] == "yes"
    # Between judges 97.49 / 3 = 32.49: F 31.87 over six targets, (F - 1) / (F + 5).
    levels = share_between(CLAIM, pd.DataFrame(rated()), "joint", "specimen", 0.05, "")
    assert levels["value"] == pytest.approx(30.87 / 36.87, abs=0.002)


def test_spreads_need_a_grid_with_something_left() -> None:
    flat = [stiff(s, j, 1.0) for s in "ab" for j in ("L4L5", "L5S1")]
    few = [stiff("a", "L4L5", 1.0), stiff("a", "L5S1", 2.0), stiff("b", "L5S1", 1.0)]
    for rows in (flat, few):
        row = share_between(CLAIM, pd.DataFrame(rows), "specimen", "joint", 0.05, "")
        assert (row["value"], row["holds"]) == (None, "undecided")
        assert row["message"]
    one_unknown = [*rated(), stiff("g", "L2L3", 1.0, identifiable=None)]
    row = share_between(CLAIM, pd.DataFrame(one_unknown), "specimen", "joint", 0.05, "")
    assert row["value"] == pytest.approx(0.71, abs=0.005)
    assert "1 specimens without all joints" in row["message"]


@pytest.mark.parametrize(
    ("p", "effect", "holds"),
    [(0.5, 0.09, "no"), (0.5, 0.11, "undecided"), (0.001, 0.01, "yes"), (0.0, 0.9, "yes")],
)
def test_f_tests_of_all_specimens_together(p: float, effect: float, holds: str) -> None:
    test = {"p": p, "p_holm": p, "effect": effect, "statistic": 2.0, "message": ""}
    rows = [test] * 3
    row = specific(CLAIM, pd.DataFrame(rows), 0.05)
    assert row["holds"] == holds
    assert row["value"] == (1.0 if p < 0.05 else 0.0)
    if p == 0.5:
        # Fisher: -2 x 3 ln 0.5 = 4.1589; the tail of chi-squared with 6 degrees of freedom is
        # exp(-x) (1 + x + x^2 / 2) at x = 2.0794.
        assert row["p"] == pytest.approx(0.125 * (1 + 2.0794 + 2.0794**2 / 2), abs=1e-4)
        assert row["high"] == pytest.approx(1 - 0.025 ** (1 / 3))  # none of three


def test_the_share_of_squares_is_adjusted_for_the_unknowns() -> None:
    """30 of 10 - 1 degrees of freedom against 20 of 10 - 2: 1 - (20 / 8) / (30 / 9) = 1/4."""
    rows = [fit("all", 30.0, 10), fit("x", 12.0, 5), fit("y", 8.0, 5)]
    outcome = nested_fits(pd.DataFrame(rows))
    row = {"effect": outcome.effect, "statistic": outcome.statistic}
    assert adjusted_share(pd.DataFrame([row])) == pytest.approx(0.25)
    gained_nothing = {"effect": 0.0, "statistic": 0.0}
    assert adjusted_share(pd.DataFrame([row, gained_nothing])) == pytest.approx(0.125)


def test_one_significant_specimen_leaves_load_cases_undecided() -> None:
    rows = [
        {"p": p, "p_holm": min(1.0, 3 * p), "effect": 0.01, "statistic": 2.0, "message": ""}
        for p in (0.01, 1, 1)
    ]
    row = specific(CLAIM, pd.DataFrame(rows), 0.05)
    # Fisher: x = -ln 0.01 = 4.605 of 6 degrees of freedom, 0.01 (1 + x + x^2 / 2).
    assert row["p"] == pytest.approx(0.01 * (1 + 4.60517 + 4.60517**2 / 2), abs=1e-5)
    assert (row["value"], row["holds"]) == (pytest.approx(1 / 3), "undecided")


def test_loaded_stiffness_against_that_of_the_other_load_cases() -> None:
    driven = {"flexion": "extension", "x": "right_bending", "y": "left_rotation"}
    errors = pd.DataFrame(
        seen(specimen, "L5S1", 1.0, test=test, coordinate=name)
        for specimen in "abc"
        for test, name in driven.items()
    )
    stiffness = [
        stiff(specimen, joint, log + twice, fitted_to=label)
        for specimen, log in zip("abc", (0.5, 0.6, 0.7), strict=True)
        for joint in ("L4L5", "L5S1")
        for label, twice in (("flexion", log), ("all_but_flexion", 0.0))
    ]
    # The second joint is far off, but ten times less certain: 1 / 101 of the weight.
    for row in stiffness:
        if row["joint"] == "L5S1" and row["fitted_to"] == "flexion":
            row["stiffness"] *= np.e
            row["standard_error"] = row["stiffness"] * 199**0.5 * 0.1
    none = pd.DataFrame(columns=["family", "p", "message"])
    found = list(load_case_findings(pd.DataFrame(stiffness), errors, none, 0.05))
    row = found[-1]
    # Weights of e^x: 1 / (0.02 e^2x) and 1 / (2 e^2x e^2), the second 1 / 738.9 of the first.
    share = 1 / (1 + 100 * 7.389056)
    ratios = [(1 - share) * r + share * 2.718282 * r for r in (1.648721, 1.822119, 2.013753)]
    assert row["value"] == pytest.approx(sum(ratios) / 3)
    assert (row["finding"], row["holds"]) == ("loaded_stiffness_differs", "yes")
    assert [one["holds"] for one in found[:2]] == ["undecided", "undecided"]


def test_noise_in_the_compliance_does_not_lean_to_one_side() -> None:
    """Compliance 1.2 and 0.8 by other load cases, SD 0.2 each, and 1, known, by its own."""
    rows = [{"specimen": "a", "ratio": np.log(value), "error": 0.2 / value} for value in (1.2, 0.8)]
    # By logarithms 0.18 with weight 36 and -0.22 with weight 16 would make exp(0.06).
    assert mean_excess(pd.DataFrame(rows)).to_dict() == pytest.approx({"a": 0.0})


def missing_of(
    better: tuple[float | None, ...], worse: tuple[float | None, ...]
) -> tuple[Row, Row]:
    """Level ratio against one stiffness, fitted to one load case, and against the literature."""
    rows = [
        seen(specimen, "L5S1", value, name, stage)
        for name, stage, values in (
            ("per_specimen", "fitted", better),
            ("level_ratio", "fitted", worse),
            ("literature", "literature", (4.0, 4.1, 4.2)),
        )
        for specimen, value in zip("abc", values, strict=True)
    ]
    table = pd.DataFrame(rows).astype({"rmse": float})
    found = {row["finding"]: row for row in error_findings(table, 0.05)}
    return found["wrong_level_ratio_worse_than_uniform"], found["optimised_beats_literature"]


def test_a_side_that_fails_where_it_is_hard_does_not_win() -> None:
    row, published = missing_of((1.0, 1.1, None), (2.0, 2.2, 2.3))
    assert row["p"] < 0.05
    assert row["holds"] == "undecided"
    assert "left out, without a result: c (one stiffness per specimen)" in row["message"]
    assert published["holds"] == "undecided"
    row, published = missing_of((1.0, 1.1, 1.2), (2.0, 2.2, None))
    assert row["holds"] == "yes"  # what fails is that said to be worse
    assert "c (published ratio of levels, scaled)" in row["message"]
    assert "without a result" not in published["message"]
    row, _ = missing_of((3.0, 3.1, 3.2), (1.0, 1.2, None))
    assert row["holds"] == "undecided"  # here it comes out better
    row, _ = missing_of((3.0, 3.1, None), (1.0, 1.2, 1.1))
    assert row["holds"] == "no"


def test_one_load_case_leaves_none_out_and_is_no_failure() -> None:
    found = {
        row["finding"]: row
        for row in error_findings(without_one_test()["errors"], significance=0.05)
    }
    assert "without a result" not in found["optimised_beats_literature_left_out_case"]["message"]


def test_what_holds_by_construction_says_so() -> None:
    row, published = missing_of((1.0, 1.1, 1.2), (2.0, 2.2, 2.3))
    assert OWN_READINGS in published["message"]
    assert OWN_READINGS not in row["message"]


def test_specimens_without_a_result_are_named_with_what_failed() -> None:
    found = {"x": series(1.0, 2.0), "y": series(1.0), "z": series(1.0, 2.0, 3.0)}
    assert without_result(found, "abc") == "b (y), c (x, y)"
    assert without_result(found, "a") == ""


def test_too_much_motion_has_the_sign_of_the_motion() -> None:
    rows = [
        seen("a", "L4L5", -1.0, measured_peak=-10.0),  # bends on to -11
        seen("a", "L5S1", -2.0, measured_peak=-10.0),
        seen("b", "L4L5", -3.0, measured_peak=10.0),  # 7 of 10
        seen("c", "L4L5", None),
    ]
    found = overprediction_percent(pd.DataFrame(rows))
    assert found.to_dict() == pytest.approx({"a": 15.0, "b": -30.0})


# whole studies with hardly any data


JOINTS = ("L3L4", "L4L5", "L5S1")


def study(
    specimens: str = "abc",
    tests: tuple[str, ...] = ("flexion", "bend", "twist"),
    representations: tuple[str, ...] = ("per_specimen", "level_ratio", "per_joint"),
    levels: bool = True,
    held_out: bool = True,
) -> dict[str, pd.DataFrame]:
    """Errors, fits and stiffness with random numbers, as the jobs before would write them."""
    rng = np.random.default_rng(1)
    labels = (*tests, *(("all",) if len(tests) > 1 else ()))
    folds = tuple(f"all_but_{test}" for test in tests) if len(tests) > 2 and held_out else ()
    errors: list[Row] = []
    fits: list[Row] = []
    stiffness: list[Row] = []

    def tell(specimen: str, name: str, label: str, stage: str, test: str) -> None:
        for joint in JOINTS:
            for place, c in enumerate(ROTATIONS):
                here = {"coordinate": c, "loaded": tests.index(test) == place}
                error = float(rng.normal())
                errors.append(seen(specimen, joint, error, name, stage, test, label, **here))

    for specimen in specimens:
        for test in tests:
            for name in ("literature", *(("literature_levels",) if levels else ())):
                tell(specimen, name, "nothing", "literature", test)
        for name in representations:
            for label in (*labels, *folds):
                of = {"specimen": specimen, "representation": name, "fitted_to": label}
                within = [test for test in tests if label in (test, "all")]
                within += [t for t in tests if label[:7] == "all_but" and label[8:] != t]
                cost = float(rng.uniform(30, 60)) * len(within)
                fits.append(fit(label, cost, 60 * len(within), 3) | of)
                for joint in JOINTS:
                    stiffness += [
                        stiff(specimen, joint, float(rng.normal()), coordinate=c) | of
                        for c in ROTATIONS
                    ]
                for test in tests:
                    stage = "fitted" if test in within else "left_out_case"
                    tell(specimen, name, label, stage, test)
                    if held_out and len(specimens) > 1 and label in labels and test in within:
                        tell(specimen, name, label, "left_out_specimen", test)
    frames = {"errors": pd.DataFrame(errors), "stiffness": pd.DataFrame(stiffness)}
    columns = list(fit("x", 0.0, 0))
    return frames | {"fits": pd.DataFrame(fits, columns=columns)}


def analysed(frames: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """All analyses, through their schemas."""
    errors, fits = frames["errors"], frames["fits"]
    rows = list(corrected_rows(all_tests(errors, fits)))
    statistics = from_rows(STATISTICS, rows).to_pandas()
    said = list(finding_rows({**frames, "statistics": statistics}, 0.05))
    return {
        "mae": from_rows(MAE, mae_rows(errors)).to_pandas(),
        "ranking": from_rows(RANKING, ranking_rows(errors, fits)).to_pandas(),
        "statistics": statistics,
        "findings": from_rows(FINDINGS, said).to_pandas(),
    }


def test_a_whole_study() -> None:
    found = analysed(study())
    assert found["ranking"]["rank"].notna().all()
    assert set(found["ranking"]["criterion"]) == {
        *("fitted", "left_out_specimen", "left_out_case", "aicc", "bic")
    }
    pooled = found["findings"]["finding"].str.startswith("partially_pooled")
    known = found["findings"]["value"].notna()
    assert (known != pooled).all()  # they alone were not computed, and say so
    assert (found["findings"].loc[pooled, "message"] != "").all()
    assert (found["statistics"]["status"] == "done").sum() > 100


def without_cross_validation() -> dict[str, pd.DataFrame]:
    return study(held_out=False)


def with_failures() -> dict[str, pd.DataFrame]:
    """Every fit of one specimen failed, every pose of one test was lost in another."""
    frames = study()
    errors, fits, stiffness = (frames[name] for name in ("errors", "fits", "stiffness"))
    errors = errors[(errors["specimen"] != "a") | (errors["stage"] == "literature")].copy()
    lost = (errors["specimen"] == "b") & (errors["test"] == "bend")
    errors.loc[lost, list(NUMBERS)] = None
    fits.loc[fits["specimen"] == "a", ["cost", "aicc", "bic"]] = None
    empty = stiffness["specimen"] == "a"
    stiffness.loc[empty, ["stiffness", "standard_error"]] = None
    stiffness["identifiable"] = stiffness["identifiable"].astype(object).mask(empty, None)
    return {"errors": errors, "fits": fits, "stiffness": stiffness}


def without_one_test() -> dict[str, pd.DataFrame]:
    """One specimen was tested in one load case only."""
    frames = study()
    keep = {name: table["specimen"] != "a" for name, table in frames.items()}
    keep["errors"] |= (frames["errors"]["test"] == "twist") & frames["errors"]["fitted_to"].isin(
        ["twist", "all", "nothing"]
    )
    fits = frames["fits"]
    fits.loc[~keep["fits"] & (fits["fitted_to"] != "twist"), ["cost", "aicc", "bic"]] = None
    keep["fits"] |= True
    return {name: table[keep[name]] for name, table in frames.items()}


def literature_only() -> dict[str, pd.DataFrame]:
    """All fits were refused."""
    frames = study()
    errors = frames["errors"]
    frames["stiffness"][["stiffness", "standard_error"]] = np.nan
    frames["fits"][["cost", "aicc", "bic"]] = np.nan
    return {**frames, "errors": errors[errors["stage"] == "literature"]}


ODD: dict[str, Callable[[], dict[str, pd.DataFrame]]] = {
    "one_specimen": lambda: study(specimens="a"),
    "two_specimens": lambda: study(specimens="ab"),
    "one_test": lambda: study(tests=("only test",)),
    "two_tests": lambda: study(tests=("x", "y")),
    "one_representation": lambda: study(representations=("level_ratio",), levels=False),
    "without_cross_validation": without_cross_validation,
    "with_failures": with_failures,
    "without_one_test": without_one_test,
    "literature_only": literature_only,
}


@pytest.mark.parametrize("name", ODD)
def test_odd_studies_keep_the_schemas_and_say_what_is_missing(name: str) -> None:
    found = analysed(ODD[name]())
    unknown = found["findings"][found["findings"]["value"].isna()]
    assert (unknown["holds"] == "undecided").all()
    assert (unknown["message"] != "").all()
    nothing = found["statistics"][found["statistics"]["p"].isna()]
    assert (nothing["message"] != "").all()
    unranked = found["ranking"][found["ranking"]["rank"].isna()]
    assert (unranked["message"] != "").all()


def test_one_specimen_decides_nothing_by_a_mean() -> None:
    found = analysed(study(specimens="a"))["findings"]
    row = only(found, finding="optimised_beats_literature")
    assert (row["holds"], row["message"][:17]) == ("undecided", "one specimen only")
    assert only(found, finding="cross_validation_beats_literature")["value"] is not None


def test_specimens_without_all_results_do_not_enter_the_ranking() -> None:
    frames = with_failures()
    ranking = pd.DataFrame(ranking_rows(frames["errors"], frames["fits"]))
    fitted = ranking[ranking["criterion"] == "fitted"]
    assert set(fitted["specimens"]) == {1}
    fits = "per_specimen, level_ratio, per_joint"
    every = f"literature, literature_levels, {fits}"
    assert fitted["message"].str.contains(f"a ({fits}), b ({every})", regex=False).all()
    assert set(ranking[ranking["criterion"] == "aicc"]["specimens"]) == {2}


def test_left_out_cases_of_two_tests_come_from_the_other_one() -> None:
    frames = study(tests=("x", "y"))
    ranking = pd.DataFrame(ranking_rows(frames["errors"], frames["fits"]))
    rows = ranking[ranking["criterion"] == "left_out_case"]
    assert rows["rank"].notna().all()


def test_without_cross_validation_nothing_is_ranked_by_it() -> None:
    frames = without_cross_validation()
    ranking = pd.DataFrame(ranking_rows(frames["errors"], frames["fits"]))
    held_out = ranking[ranking["criterion"].isin(["left_out_specimen", "left_out_case"])]
    ranked_names = held_out.loc[held_out["rank"].notna(), "representation"]
    assert set(ranked_names) == {"literature", "literature_levels"}


def test_pooled_spreads_are_told_beside() -> None:
    pooling = [
        {
            "fitted_to": "all",
            "without": who,
            "coordinate": "extension",
            "between_specimens": value,
            "between_levels": None,
            "status": "converged",
            "message": "",
        }
        for who, value in (("nobody", 0.25), ("a", 0.5))
    ]
    rows = list(stiffness_spreads(pd.DataFrame(rated()), pd.DataFrame(pooling), 0.05))
    assert "SD of the logarithm 0.25" in rows[0]["message"]
    assert "pooled" not in rows[1]["message"]
    unsettled = [row | {"status": "not_converged", "message": "they swing"} for row in pooling]
    rows = list(stiffness_spreads(pd.DataFrame(rated()), pd.DataFrame(unsettled), 0.05))
    assert "no pooled fit; they swing" in rows[0]["message"]
    assert "0.25" not in rows[0]["message"]


# labels of fits and tests


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


def test_a_left_out_case_beside_one_read_in_translations_only() -> None:
    frames = without_rotations_in("pull", tests=("flexion", "bend", "pull"))
    found = analysed(frames)["statistics"]
    family = "between_specimens/per_joint/left_out_case"
    rows = found[(found["family"] == family) & (found["test"] == "Friedman")]
    assert set(rows["stratum"]) == {"flexion", "bend"}
    assert (rows.loc[rows["response"] == "rotation_error", "n"] == len(JOINTS)).all()


def test_of_two_load_cases_one_may_be_read_in_translations_only() -> None:
    frames = without_rotations_in("pull", tests=("flexion", "pull"))
    found = analysed(frames)
    family = "between_specimens/per_joint/left_out_case"
    assert (found["statistics"]["family"] == family).any()
    ranking = found["ranking"]
    assert ranking.loc[ranking["criterion"] == "left_out_case", "rank"].notna().all()


def test_loaded_stiffness_beside_a_load_case_without_main_moment() -> None:
    """Of two loaded tests and a pull, the others of flexion are in all_but_flexion."""
    rows = [
        stiff(specimen, "L5S1", log, fitted_to=label)
        for specimen in "ab"
        for label, log in (("flexion", 0.5), ("bend", 9.0), ("pull", 9.0), ("all_but_flexion", 0.0))
    ]
    directions = pd.DataFrame(
        {"specimen": specimen, "test": test, "coordinate": name}
        for specimen in "ab"
        for test, name in (("flexion", "extension"), ("bend", "right_bending"))
    )
    assert loaded_ratios(pd.DataFrame(rows), directions)["ratio"].to_list() == [0.5, 0.5]


def test_loaded_stiffness_of_specimens_with_different_main_moments() -> None:
    rows = [
        stiff(specimen, "L5S1", log, fitted_to=label, coordinate=name)
        for specimen in "ab"
        for name in ("extension", "right_bending")
        for label, log in (("x", 0.5), ("all_but_x", 0.0))
    ]
    errors = pd.DataFrame(
        seen(specimen, "L5S1", 1.0, test="x", coordinate=name)
        for specimen, name in (("a", "extension"), ("b", "right_bending"))
    )
    none = pd.DataFrame(columns=["family", "p", "message"])
    *_, row = load_case_findings(pd.DataFrame(rows), errors, none, 0.05)
    assert "; 2 ratios" in row["message"]  # each in its own coordinate


def without_rotations_in(test: str, **choices: Any) -> dict[str, pd.DataFrame]:
    """One test was read in a translation only, in which it has no main moment."""
    frames = study(**choices)
    errors = frames["errors"]
    here = errors["test"] == test
    errors.loc[here, "loaded"] = False
    errors = errors[~here | (errors["coordinate"] == "extension")].copy()
    errors.loc[errors["test"] == test, "coordinate"] = "superior"
    return {**frames, "errors": errors}


# other findings of a review


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


def test_a_test_that_drives_two_coordinates_has_two_rows_of_errors() -> None:
    """Specimen b lay on its side: its main moment has another axis."""
    rows = [
        seen("a", "L5S1", 2.0, measured_peak=10.0),
        seen("a", "L5S1", 8.0, coordinate="right_bending", loaded=False),
        seen("b", "L5S1", 3.0, measured_peak=20.0, coordinate="right_bending"),
        seen("b", "L5S1", 9.0, loaded=False),
    ]
    found = from_rows(MAE, mae_rows(pd.DataFrame(rows))).to_pandas()
    peak = found[found["steps"] == "peak"].set_index("coordinate")
    assert peak["mae_deg"].to_dict() == {"extension": 2.0, "right_bending": 3.0}
    assert peak["largest_motion_deg"].to_dict() == {"extension": 10.0, "right_bending": 20.0}


SURE, UNSURE, BETTER = (2.0, 2.1, 2.2), (0.9, 1.1, 1.3), (0.5, 0.6, 0.7)
"""Errors of three specimens against 1 deg: 1.1 +- 0.06, 0.1 +- 0.12, -0.4 +- 0.06 (SE)."""


@pytest.mark.parametrize(
    ("second", "holds", "worse"),
    [
        (SURE, "yes", 2),
        (BETTER, "no", 1),
        (UNSURE, "undecided", 1),  # larger in the mean, but not surely
        ((None, None, None), "undecided", 1),
        ((2.0, 2.1, None), "yes", 2),  # what fails is that said to be worse
        ((0.5, 0.6, None), "undecided", 1),
    ],
)
def test_worse_at_every_level_is_decided_level_by_level(
    second: tuple[float | None, ...], holds: str, worse: int
) -> None:
    """One stiffness leaves 1 deg at both joints."""
    rows = [
        seen(specimen, joint, error, name)
        for joint, errors in (("L4L5", SURE), ("L5S1", second))
        for place, specimen in enumerate("abc")
        for name, error in (("per_specimen", 1.0), ("level_ratio", errors[place]))
    ]
    table = pd.DataFrame(rows).astype({"rmse": float})
    ratio, uniform = (table[table["representation"] == n] for n in ("level_ratio", "per_specimen"))
    row = every_level(ratio, uniform, table, 0.05)
    assert (row["holds"], row["value"]) == (holds, worse)
    assert ("L5S1" in row["message"]) == (worse == 1)
    assert ("c (published" in row["message"]) == (second[2] is None)
    ratio = ratio.assign(rmse=None)
    assert every_level(ratio, uniform, table, 0.05)["value"] is None


def test_interval_of_a_mean_is_students() -> None:
    """0.4, 0.5, 0.9: mean 0.6, SD sqrt(0.07), Student's t of 2 degrees of freedom 4.302653."""
    found = mean_of(np.array([0.4, 0.5, 0.9]))
    reach = 4.302653 * (0.07 / 3) ** 0.5
    assert found.interval == pytest.approx((0.6 - reach, 0.6 + reach))
    assert mean_of(np.array([0.4])).interval is None
