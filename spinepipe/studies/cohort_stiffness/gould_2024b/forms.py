"""Forms of claims that many of the paper's numbers share."""

from collections.abc import Callable

from spinepipe.comparison.claim import Claim, Ours, Verdict
from spinepipe.comparison.gould_2024b.paper import PHANTOM
from spinepipe.comparison.ranges import Range, exactly
from spinepipe.comparison.run import Run

YES_NO = "1: yes, 0: no"


def yes_or_no(
    key: str,
    where: str,
    quantity: str,
    paper: bool,
    ours: Callable[[Run], Ours],
    outside: str = PHANTOM,
    note: str = "",
    evidence: Verdict = Verdict.INSIDE,
) -> Claim:
    """Something that the paper says to be so or not."""
    value = float(paper)
    return Claim(
        key, where, quantity, YES_NO, value, exactly(value), ours, outside, note, evidence=evidence
    )


def recomputed(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: float,
    note: str,
) -> Claim:
    """A number that the paper's other numbers give."""
    return Claim(
        f"closed_form.{key}", where, quantity, unit, paper, allowed, lambda run: Ours(ours),
        "the formula does not give the printed number", note, evidence=Verdict.RECOMPUTED,
    )  # fmt: skip


def contradicted(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    ours: float,
    reason: str,
) -> Claim:
    """A number that the paper's other numbers exclude."""
    allowed = Range(paper, paper, "the paper's value itself")
    return Claim(
        key, where, quantity, unit, paper, allowed, lambda run: Ours(ours), "",
        note="ours: from the paper's other numbers", contradicted=reason,
    )  # fmt: skip


def rounded(value: float, unit_of_last_digit: float) -> Range:
    """What rounds to a printed number."""
    half = unit_of_last_digit / 2.0
    return Range(value - half, value + half, "what rounds to the printed number")
