"""Claims beside each other: few specimens, many claims, and what is no test."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from spinepipe.studies.cohort_stiffness.claims import BY_CONSTRUCTION, CohortClaim, Row
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import SPECIFIC, load_case_claim
from spinepipe.studies.cohort_stiffness.findings import decide_together, mark_circular

SIGNIFICANCE = 0.05


def row(
    holds: str,
    p: float | None = None,
    specimens: int | None = None,
    message: str = "told",
    p_no: float | None = None,
) -> Row:
    return CohortClaim("name", "Statement.", "quantity", "deg").row(
        holds, message, 1.0, None, p, specimens, p_no
    )


def judged(*rows: Row, specimens: int = 6) -> list[Row]:
    return list(decide_together(rows, specimens, SIGNIFICANCE))


@pytest.mark.parametrize(("p", "holds"), [(0.016, "yes"), (0.017, "undecided")])
@pytest.mark.parametrize("side", ["yes", "no"])
def test_three_claims_need_a_third_of_the_p(p: float, holds: str, side: str) -> None:
    first, *_ = judged(row(side, p), row("undecided", 0.4), row("undecided", 0.5))
    assert first["p_holm"] == pytest.approx(3.0 * p)
    assert first["p"] == p
    assert first["holds"] == (side if holds == "yes" else holds)
    assert ("beside the other claims" in first["message"]) == (holds != "yes")


@pytest.mark.parametrize(
    ("own", "study", "holds"), [(2, 6, "undecided"), (3, 6, "yes"), (None, 2, "undecided")]
)
def test_two_specimens_decide_nothing(own: int | None, study: int, holds: str) -> None:
    (found,) = judged(row("yes", 1e-9, own), specimens=study)
    assert found["holds"] == holds
    assert (found["message"] == "2 specimens, and a verdict needs 3; told") == (holds != "yes")


def test_what_is_true_by_construction_is_no_test_beside_others() -> None:
    construction = row("circular", 1e-9) | {BY_CONSTRUCTION: True}
    circular, other = judged(construction, row("yes", 0.04))
    assert (circular["holds"], circular["p_holm"]) == ("circular", None)
    assert (other["holds"], other["p_holm"]) == ("yes", 0.04)


@pytest.mark.parametrize(("p_no", "holds"), [(0.016, "no"), (0.017, "undecided")])
def test_a_no_by_a_small_interval_is_corrected_like_a_yes(p_no: float, holds: str) -> None:
    """Its p is large and tells nothing; the p that it matters decides, times three."""
    found, *_ = judged(row("no", 0.6, p_no=p_no), row("undecided", 0.4), row("undecided", 0.5))
    assert (found["holds"], found["p"]) == (holds, 0.6)
    assert found["p_holm"] == pytest.approx(3.0 * p_no)


def test_any_false_decision_among_claims_with_two_tests_is_as_rare_as_said() -> None:
    """Five effects of nothing and five at the margin of what matters, 4 standard errors away.

    3000 studies: three standard errors of a share of 0.05 are 0.012.
    """
    rng, studies, margin = np.random.default_rng(5), 3000, 4.0
    true = np.array([0.0] * 5 + [margin] * 5)
    z = rng.normal(true, 1.0, size=(studies, 10))
    p, p_no = 2.0 * norm.sf(np.abs(z)), np.minimum(1.0, 2.0 * norm.cdf(z - margin))
    verdict = np.where(p < SIGNIFICANCE, "yes", np.where(p_no < SIGNIFICANCE, "no", "undecided"))
    held = [
        [found["holds"] for found in judged(*map(with_two_tests, *one))]
        for one in zip(verdict, p, p_no, strict=True)
    ]
    false = np.array(held) == np.where(true > 0.0, "no", "yes")
    assert false.any(axis=1).mean() < 0.05 + 0.012
    by_itself = verdict == np.where(true > 0.0, "no", "yes")
    assert by_itself.any(axis=1).mean() > 0.2  # uncorrected it would be far more


def with_two_tests(holds: str, p: float, p_no: float) -> Row:
    return row(str(holds), float(p), p_no=float(p_no))


def test_a_claim_of_two_tests_stays_among_the_others_when_one_is_settled() -> None:
    """0.001 x 3 claims, then 0.02 x 3 as the first may still be nothing, then 0.03 x 2."""
    told = judged(row("no", 0.9, p_no=0.001), row("yes", 0.02), row("yes", 0.03))
    assert [one["p_holm"] for one in told] == pytest.approx([0.003, 0.06, 0.06])


def test_a_no_by_size_alone_has_no_p_to_correct() -> None:
    """Its p is that there is no effect, which did not decide; it counts beside the others' p."""
    one = {"effect": 0.01, "statistic": 1.1, "message": ""}
    tests = pd.DataFrame([{"p": 0.3, "p_holm": 1.0, **one}] * 3)
    small = load_case_claim(SPECIFIC["per_joint"], tests, SIGNIFICANCE)
    assert (small["holds"], small["p"] > 0.05) == ("no", True)
    found, other = judged(small, row("yes", 1e-4))
    assert (found["holds"], found["p_holm"]) == ("no", None)
    assert other["p_holm"] == pytest.approx(2e-4)


def test_what_is_not_asked_stays_so_with_few_specimens() -> None:
    claim = CohortClaim("name", "Statement.", "quantity", "deg")
    (found,) = judged(claim.not_asked("neither was computed"), specimens=1)
    assert (found["holds"], found["message"]) == ("not_asked", "neither was computed")


@pytest.mark.parametrize(
    ("finding", "holds", "told"),
    [
        ("stiffness_differs_between_levels_extension", "yes", "circular"),
        ("stiffness_differs_between_levels_extension", "no", "no"),
        ("wrong_level_ratio_worse_than_uniform", "yes", "circular"),
        ("per_joint_beats_per_specimen_left_out_case", "yes", "yes"),
        ("stiffness_is_load_case_specific", "yes", "yes"),
    ],
)
def test_what_was_put_into_a_made_up_cohort_is_no_finding(
    finding: str, holds: str, told: str
) -> None:
    """What the method makes of it may be one: load cases must not differ where truth is linear."""
    found = mark_circular(
        CohortClaim(finding, "Statement.", "quantity", "").row(holds, "told", 1.0)
    )
    assert found["holds"] == told
    assert ("made up" in found["message"]) == (told == "circular")
