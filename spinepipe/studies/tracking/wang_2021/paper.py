"""Forms of claims about Wang et al. 2021, doi 10.1007/s10439-021-02774-3.

Its persons and X-rays are not published. What is single numbers of theirs, without a spread, is not
comparable with ours, and is shown without a verdict; what holds of approaches whoever was tracked,
orders and ranges that it prints, is compared. An order that persons here do not tell has none.
"""

from collections.abc import Callable

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict, exactly

YES_NO = "1: yes, 0: no"
OTHER_PERSONS = "persons, skin and passive elements are others than the paper's"

Value = Callable[[Run], Ours]


def put_in(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    ours: Value,
    allowed: Range | None = None,
    note: str = "",
) -> Claim:
    """What the cohort or the study was made to have; without a range it has it exactly."""
    if allowed is None:
        assert paper is not None
        allowed = near(paper, 1e-6 * max(abs(paper), 1.0), "it is written down")
    outside = "this cohort or study is not as the paper's"
    evidence = Verdict.CIRCULAR
    return Claim(key, where, quantity, unit, paper, allowed, ours, outside, note, evidence=evidence)


def near(value: float, to: float, why: str) -> Range:
    """A value and how far ours may be from it."""
    return Range(value - to, value + to, f"the paper's value to {to:g}: {why}")


def spread(value: float, sd: float) -> Range:
    """A mean over persons, less and plus their SD."""
    return Range(value - sd, value + sd, "the paper's mean less and plus its SD")


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
    """What the paper's other numbers or formulas give."""
    outside, evidence = "the formula does not give the printed number", Verdict.RECOMPUTED
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        outside,
        note,
        evidence=evidence,
    )


def contradicted(
    key: str, where: str, quantity: str, unit: str, paper: float, ours: float, reason: str
) -> Claim:
    """What the paper's other numbers or words exclude."""
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        exactly(paper),
        lambda run: Ours(ours),
        "",
        note="ours: from the paper's other numbers and words",
        contradicted=reason,
    )


def missing(key: str, where: str, quantity: str, unit: str, paper: float | None, why: str) -> Claim:
    """A number that no run has anything to set beside, and why."""

    def ours(run: Run) -> Ours:
        raise NotComputed(why)

    return Claim(key, where, quantity, unit, paper, _shown(paper), ours, "")


def not_comparable(
    key: str, where: str, quantity: str, unit: str, paper: float, ours: Value
) -> Claim:
    """A number of the paper's own persons: ours is told beside it, and nothing is concluded."""

    def told(run: Run) -> Ours:
        found = ours(run)
        note = f"; {found.note}" if found.note else ""
        raise NotComputed(
            f"not comparable: {OTHER_PERSONS}, and no uncertainty is printed; ours here is "
            f"{f'{found.value:.3g} {unit}'.strip()}{note}"
        )

    return Claim(key, where, quantity, unit, paper, _shown(paper), told, "")


def beside(
    key: str, where: str, quantity: str, unit: str, window: Range, ours: Value, why: str
) -> Claim:
    """A range of the paper's own persons that concludes nothing of others: ours is told with it."""

    def told(run: Run) -> Ours:
        found = ours(run)
        ends = "" if found.low is None else f" ({found.low:.3g} to {found.high:.3g})"
        note = f"; {found.note}" if found.note else ""
        value = f"{found.value:.3g} {unit}{ends}"
        raise NotComputed(f"not comparable: {why}; ours here is {value}{note}")

    return Claim(key, where, quantity, unit, None, window, told, "")


def yes_no(
    key: str, where: str, quantity: str, ours: Callable[[Run], tuple[bool, str]], note: str = ""
) -> Claim:
    """Something the paper says is so; ours with the numbers that decide it."""

    def told(run: Run) -> Ours:
        found, numbers = ours(run)
        return Ours(float(found), note=numbers)

    allowed = exactly(1.0)
    return Claim(key, where, quantity, YES_NO, 1.0, allowed, told, OTHER_PERSONS, note)


def _shown(paper: float | None) -> Range:
    return Range(None, None, "none") if paper is None else exactly(paper)
