"""Claims beside each other: few specimens, many claims, and what is no test."""

import pytest

from spinepipe.studies.cohort_stiffness.claims import BY_CONSTRUCTION, Claim, Row
from spinepipe.studies.cohort_stiffness.claims_together import together

SIGNIFICANCE = 0.05


def row(
    holds: str, p: float | None = None, specimens: int | None = None, message: str = "told"
) -> Row:
    return Claim("name", "Statement.", "quantity", "deg").row(
        holds, message, 1.0, None, p, specimens
    )


def judged(*rows: Row, specimens: int = 6) -> list[Row]:
    return list(together(rows, specimens, SIGNIFICANCE))


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


def test_a_no_by_a_small_interval_needs_no_p() -> None:
    """Surely too little to matter: its p is large, and stays so."""
    found, _ = judged(row("no", 0.6), row("yes", 1e-4))
    assert found["holds"] == "no"


def test_what_is_not_asked_stays_so_with_few_specimens() -> None:
    claim = Claim("name", "Statement.", "quantity", "deg")
    (found,) = judged(claim.not_asked("neither was computed"), specimens=1)
    assert (found["holds"], found["message"]) == ("not_asked", "neither was computed")
