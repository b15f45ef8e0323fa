"""The numbers of Ghezelbash et al. 2016, and forms of claims about them.

Our geometry, muscles and passive curves are others than the paper's, which does not print its own.
Where they decide a number, a range says from where on ours is another result and no agreement is
claimed from size alone; all ranges are chosen before and none from our results.
"""

import tomllib
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict, exactly

PAPER: Mapping[str, Any] = tomllib.loads(
    files("spinepipe.studies.trunk_loads.ghezelbash_2016")
    .joinpath("paper.toml")
    .read_text(encoding="utf-8")
)
"""All numbers of the paper, as `paper.toml` has them."""

VOLUNTEER = "volunteer"
"""Who stands for the man whose pressures Wilke 2001 measured."""

PERSONS: Mapping[str, str] = {key: PAPER["table_2"][key]["specimen"] for key in "ABCD"}
"""Columns of Table 2, and curves of Fig 9, as the cohort calls these persons."""

YES_NO = "1: yes, 0: no"

OTHER_MODEL = "geometry, muscles and passive curves are others: the paper does not print its own"

NO_EMG = "EMG of the volunteers is not published"
NO_EQ_4_5 = "tasks of this study cannot ask for shear (Eq 4) or moments of antagonists (Eq 5)"

Value = Callable[[Run], Ours]


def rounded(value: float, unit_of_last_digit: float) -> Range:
    """What rounds to a printed number; a trifle more, for halves that floats miss."""
    half = 0.5 * unit_of_last_digit * (1.0 + 1e-9)
    return Range(value - half, value + half, "what rounds to the printed number")


def near(value: float, to: float, why: str) -> Range:
    """A value and how far ours may be from it."""
    return Range(value - to, value + to, f"the paper's value to {to:g}: {why}")


def as_persons_differ(value: float) -> Range:
    """A force that no uncertainty is printed of: as far as one person's is from another's."""
    share = PAPER["fig_9"]["compression_percent"] / 100.0
    what = (
        f"within {100.0 * share:g} % of the paper's value: by as much two persons of Fig 9 differ, "
        "so farther off ours is another load"
    )
    return Range(value * (1.0 - share), value * (1.0 + share), what)


def put_in(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float,
    ours: Value,
    allowed: Range | None = None,
    outside: str = "this cohort or study is not as the paper's",
    note: str = "",
) -> Claim:
    """What the cohort or the study was made to have; without a range it has it exactly."""
    evidence = Verdict.CIRCULAR
    held = allowed or near(paper, 1e-9 * max(abs(paper), 1.0), "it is written down")
    return Claim(key, where, quantity, unit, paper, held, ours, outside, note, evidence=evidence)


def recomputed(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: float,
    note: str = "",
) -> Claim:
    """What the paper's other numbers or formulas give."""
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        "the formula does not give the printed number",
        note,
        evidence=Verdict.RECOMPUTED,
    )


def confronted(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float,
    allowed: Range,
    ours: float,
    reason: str,
) -> Claim:
    """What the paper's other numbers say of a number: contradicted where the range excludes it."""
    agrees, told = allowed.holds(ours), "ours: from the paper's other numbers and formulas"
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        "",
        note="; ".join([*([reason] if agrees else []), told]),
        contradicted="" if agrees else reason,
        evidence=Verdict.RECOMPUTED,
    )


def missing(key: str, where: str, quantity: str, unit: str, paper: float | None, why: str) -> Claim:
    """A number that no run has anything to set beside, and why."""

    def ours(run: Run) -> Ours:
        raise NotComputed(why)

    shown = Range(None, None, "none") if paper is None else exactly(paper)
    return Claim(key, where, quantity, unit, paper, shown, ours, "")


def yes_no(
    key: str, where: str, quantity: str, ours: Callable[[Run], bool], outside: str = OTHER_MODEL
) -> Claim:
    """Something the paper says is so."""
    return Claim(
        key, where, quantity, YES_NO, 1.0, exactly(1.0), lambda run: Ours(float(ours(run))), outside
    )
