"""What decides the claims about a cohort: numbers worked by hand.

Seen here: a claim decided by the wrong test, interval, correction or side.
"""

import numpy as np
import pandas as pd
import pytest
from cohort_analysis_cases import CLAIM, Row, fit, rated, seen, series, stiff

from spinepipe.studies.cohort_stiffness.claims import above_zero
from spinepipe.studies.cohort_stiffness.claims_of_errors import (
    OWN_READINGS,
    error_findings,
    error_spreads,
    every_level,
    overprediction_percent,
)
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import (
    adjusted_share,
    load_case_claim,
    load_case_findings,
    loaded_ratios,
    mean_excess,
    share_between,
    stiffness_spreads,
)
from spinepipe.studies.cohort_stiffness.findings import decide_together
from spinepipe.studies.cohort_stiffness.significance import nested_fits
from spinepipe.studies.cohort_stiffness.stages import without_result


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


@pytest.mark.parametrize("spread", [0.02, 0.05, 0.1, 0.3])
def test_a_share_is_surely_little_where_its_whole_interval_is(spread: float) -> None:
    """Below 0.1: the p that it matters says the same as the upper end of the 95 % interval."""
    rng = np.random.default_rng(3)
    noise = rng.normal(size=(40, 30))
    rows = [
        stiff(f"s{place:02d}", f"j{level:02d}", spread * place / 40 + noise[place, level])
        for place in range(40)
        for level in range(30)
    ]
    row = share_between(CLAIM, pd.DataFrame(rows), "specimen", "joint", 1e-9, "")
    assert row["p_no"] is not None
    assert (row["p_no"] < 0.05) == (row["high"] < 0.1)
    assert (row["p_no"] < 1e-9) == (row["holds"] == "no")


def friedman(what: str, n: int, p: float, **more: object) -> Row:
    """A row of ``statistics`` of fitted errors between specimens or levels."""
    row = {"family": f"between_{what}/per_specimen/fitted", "test": "Friedman", "message": ""}
    row |= {"response": "loaded_error", "stratum": "flexion", "statistic": 4.0, "effect": 0.5}
    return {**row, "n": n, "p": p, **more}


@pytest.mark.parametrize(
    ("what", "blocks", "groups", "specimens"), [("levels", 2, 5, 2), ("specimens", 5, 4, 4)]
)
def test_specimens_of_a_friedman_test_are_its_own(
    what: str, blocks: int, groups: int, specimens: int
) -> None:
    """Of six specimens two have a complete block of levels, or four are compared."""
    w = 0.6  # Kendall's W is the statistic over blocks (groups - 1)
    statistic = w * blocks * (groups - 1)
    rows = pd.DataFrame([friedman(what, blocks, 1e-6, statistic=statistic, effect=w)])
    found = {row["finding"]: row for row in error_spreads(rows, 0.05)}
    row = found[f"errors_differ_between_{what}"]
    assert (row["specimens"], row["holds"]) == (specimens, "yes")
    (beside,) = decide_together([row], 6, 0.05)
    assert beside["holds"] == ("undecided" if specimens < 3 else "yes")
    assert ("2 specimens, and a verdict needs 3" in beside["message"]) == (specimens < 3)


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
    ("ps", "effect", "holds"),
    [
        ((0.5, 0.5, 0.5), 0.09, "no"),
        ((0.5, 0.5, 0.5), 0.11, "undecided"),
        ((0.01, 1.0, 1.0), 0.01, "undecided"),
        ((0.001, 0.001, 0.001), 0.01, "yes"),
        ((0.0, 0.0, 0.0), 0.9, "yes"),
    ],
)
def test_f_tests_of_all_specimens_together(
    ps: tuple[float, ...], effect: float, holds: str
) -> None:
    rows = [
        {"p": p, "p_holm": min(1.0, 3 * p), "effect": effect, "statistic": 2.0, "message": ""}
        for p in ps
    ]
    row = load_case_claim(CLAIM, pd.DataFrame(rows), 0.05)
    below = sum(3 * p < 0.05 for p in ps)
    assert (row["value"], row["holds"]) == (pytest.approx(below / 3), holds)
    if max(ps) >= 0.5:
        # Fisher: x = -sum of ln p; the tail of chi-squared with 6 degrees of freedom is
        # exp(-x) (1 + x + x^2 / 2).
        x = -np.log(ps).sum()
        assert row["p"] == pytest.approx(np.exp(-x) * (1 + x + x**2 / 2))
    if not below:
        assert row["high"] == pytest.approx(1 - 0.025 ** (1 / 3))  # none of three


def test_the_share_of_squares_is_adjusted_for_the_unknowns() -> None:
    """30 of 10 - 1 degrees of freedom against 20 of 10 - 2: 1 - (20 / 8) / (30 / 9) = 1/4."""
    rows = [fit("all", 30.0, 10), fit("x", 12.0, 5), fit("y", 8.0, 5)]
    outcome = nested_fits(pd.DataFrame(rows))
    row = {"effect": outcome.effect, "statistic": outcome.statistic}
    assert adjusted_share(pd.DataFrame([row])) == pytest.approx(0.25)
    gained_nothing = {"effect": 0.0, "statistic": 0.0}
    assert adjusted_share(pd.DataFrame([row, gained_nothing])) == pytest.approx(0.125)


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
    assert [one["holds"] for one in found[:2]] == ["not_asked", "not_asked"]


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


def test_pooled_spreads_are_told_beside() -> None:
    pooling = [
        {
            "representation": "partially_pooled",
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


def test_a_claim_of_errors_is_corrected_for_its_own_tests() -> None:
    """Of three load cases, not also for those of all rotations: 0.015 times 3, not times 6."""
    rows = [
        friedman("levels", 4, p, response=response, stratum=stratum)
        for response in ("loaded_error", "rotation_error")
        for stratum, p in (("flexion", 0.3), ("bend", 0.015), ("twist", 0.2))
    ]
    found = {row["finding"]: row for row in error_spreads(pd.DataFrame(rows), 0.05)}
    row = found["errors_differ_between_levels"]
    assert row["p"] == pytest.approx(3 * 0.015)
    assert row["holds"] == "yes"
    assert "under: bend; 3 load cases" in row["message"]
