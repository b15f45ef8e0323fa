"""A published number, and what a run says to it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import NotComputed, Run


class Verdict(StrEnum):
    """How a run stands to a published number."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    CIRCULAR = "circular"
    RECOMPUTED = "recomputed"
    CONTRADICTED = "contradicted"
    NOT_COMPUTED = "not_computed"


@dataclass(frozen=True)
class Ours:
    """Our value, the ends of our range where there is one, and what a reader must know."""

    value: float
    low: float | None = None
    high: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Claim:
    """One published quantity.

    Attributes
    ----------
    id : unique, dotted.
    where : table or section of the paper.
    paper : the printed value, None where a range or a bound alone is printed.
    range : where our value counts as inside, and what this range is.
    ours : our value from the tables of a run; raises `NotComputed` where they lack it.
    outside : what is known of the reason, told only when ours is outside.
    note : what a reader must know in any case.
    contradicted : how the paper's own numbers exclude each other; empty where they do not.
    evidence : what it is called when ours is inside: `CIRCULAR` where the cohort was built to have
        the number, `RECOMPUTED` where it follows from the paper's other numbers alone.
    """

    id: str
    where: str
    quantity: str
    unit: str
    paper: float | None
    range: Range
    ours: Callable[[Run], Ours]
    outside: str
    note: str = ""
    contradicted: str = ""
    evidence: Verdict = Verdict.INSIDE


def judge(claim: Claim, run: Run) -> dict[str, Any]:
    """One row of the table ``against_<paper>``."""
    ours, missing = _ours(claim, run)
    verdict = _verdict(claim, ours)
    return {
        "id": claim.id,
        "where": claim.where,
        "quantity": claim.quantity,
        "unit": claim.unit,
        "paper": claim.paper,
        "paper_low": claim.range.low,
        "paper_high": claim.range.high,
        "ours": None if ours is None else ours.value,
        "ours_low": None if ours is None else ours.low,
        "ours_high": None if ours is None else ours.high,
        "verdict": verdict.value,
        "reason": _reason(claim, verdict, ours, missing),
    }


def _ours(claim: Claim, run: Run) -> tuple[Ours | None, str]:
    """Our value, or None and the reason."""
    try:
        return claim.ours(run), ""
    except NotComputed as error:
        return None, str(error)


def _verdict(claim: Claim, ours: Ours | None) -> Verdict:
    if claim.contradicted:
        return Verdict.CONTRADICTED
    if ours is None:
        return Verdict.NOT_COMPUTED
    return claim.evidence if claim.range.holds(ours.value) else Verdict.OUTSIDE


def _reason(claim: Claim, verdict: Verdict, ours: Ours | None, missing: str) -> str:
    """What the range is, why ours is outside it or absent, and the notes."""
    told = {
        Verdict.OUTSIDE: [_factor(claim, ours), claim.outside],
        Verdict.CONTRADICTED: [f"not compared: {claim.contradicted}", missing],
        Verdict.NOT_COMPUTED: [missing],
    }.get(verdict, [])
    compared = "" if verdict is Verdict.CONTRADICTED else f"range: {claim.range.what}"
    parts = [compared, *told, claim.note, ours.note if ours else ""]
    return "; ".join(part for part in parts if part)


def _factor(claim: Claim, ours: Ours | None) -> str:
    """Ours in terms of the paper's value, where both are sizes and not a count or yes or no."""
    paper, fixed = claim.paper, claim.range.low == claim.range.high
    if paper is None or ours is None or fixed or paper <= 0.0 or ours.value < 0.0:
        return ""
    return f"ours is {ours.value / paper:.2g} times the paper's"


Rows = list[Mapping[str, Any]]


def judged(claims: tuple[Claim, ...], run: Run) -> Rows:
    """All rows of the table, in the order of the claims."""
    return [judge(claim, run) for claim in claims]
