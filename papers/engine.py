"""Published numbers beside those of a run: rows of ``<paper>.csv``, each with a verdict.

A row names a rule, which makes the range inside which a value agrees (`ranges`), and a selector,
which reads our value from the tables of a run (`selectors`, and the file of the paper's own).
"""

import csv
import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, NoReturn

import pandas as pd

from papers.ranges import RULES, Limit, Range
from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import selectors_of

FOLDER = Path(__file__).parent


class Evidence(StrEnum):
    """What a number can show: agreement alone is evidence where it is independent.

    CIRCULAR : the cohort or the study was made to have the number. RECOMPUTED : it follows from
    other numbers of the paper. CONTRADICTED : other numbers of the paper exclude it.
    """

    INDEPENDENT = "independent"
    CIRCULAR = "circular"
    RECOMPUTED = "recomputed"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True)
class Claim:
    """One published quantity.

    Attributes
    ----------
    id : unique, dotted.
    where : table or section of the paper.
    printed : the value, None where a range or a bound alone is printed.
    range : where our value counts as inside, and what this range is.
    ours : our value from a run; raises `NotComputed` where the run lacks it.
    evidence : None of what no run can have, or nothing is concluded from.
    contradicted : how the paper's own numbers exclude each other; empty where they do not.
    also : ranges of what else the paper prints of a contradicted quantity that a run has. A value
        of ours outside all of them disagrees with the paper whichever number is right.
    outside : what is known of the reason, told only when ours is outside.
    note : what a reader must know in any case.
    """

    id: str
    where: str
    quantity: str
    unit: str
    printed: float | None
    range: Range
    ours: Callable[[StudyRun], Computed]
    evidence: Evidence | None = Evidence.INDEPENDENT
    contradicted: str = ""
    also: tuple[Range, ...] = ()
    outside: str = ""
    note: str = ""


# --- from a row of a csv to a claim ---------------------------------------------------------------

COLUMNS = (
    *("id", "where", "quantity", "unit", "printed", "rule", "rule_args", "selector"),
    *("selector_args", "evidence", "contradicted", "also", "missing", "outside", "note"),
)


def rows_of(paper: str) -> list[dict[str, str]]:
    """The rows of a paper as they are written."""
    with (FOLDER / f"{paper}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def claim_of(row: Mapping[str, str], selectors: Mapping[str, Callable[..., Computed]]) -> Claim:
    """One row, its rule applied and its selector found."""
    return Claim(
        **{name: row[name] for name in ("id", "where", "quantity", "unit", "contradicted")},
        printed=float(row["printed"]) if row["printed"] else None,
        range=_range(row["rule"], row["rule_args"]),
        ours=_ours(row, selectors),
        evidence=Evidence(row["evidence"]) if row["evidence"] else None,
        also=tuple(_range(*one.split(": ", 1)) for one in row["also"].split(" | ") if one),
        outside=row["outside"],
        note=row["note"],
    )


def _range(rule: str, args: str) -> Range:
    """Arguments stand in order, parted by semicolons; the last may be words with semicolons."""
    count = len(inspect.signature(RULES[rule]).parameters)
    return RULES[rule](*(value_of(arg) for arg in args.split("; ", max(count - 1, 0)) if count))


def arguments(text: str) -> dict[str, Any]:
    """``name=value; name=one|other`` as keywords; several values are a tuple."""
    parts = re.split(r";\s+(?=\w+=)", text) if text else []
    pairs = (part.split("=", 1) for part in parts)
    return {
        name: tuple(map(value_of, value.split("|"))) if "|" in value else value_of(value)
        for name, value in pairs
    }


def value_of(text: str) -> Any:
    """A number, true or false, a dash for nothing, else the text."""
    if text == "-":
        return None
    try:
        found = json.loads(text)
    except json.JSONDecodeError:
        return text
    return float(found) if type(found) in (int, float) else found


def _ours(row: Mapping[str, str], selectors: Mapping[str, Callable[..., Computed]]) -> Any:
    """Our value; what is shown without a verdict is told in the reason alone."""
    args, missing, unit = arguments(row["selector_args"]), row["missing"], row["unit"]

    def not_here(run: StudyRun) -> NoReturn:
        raise NotComputed(missing)

    def shown(run: StudyRun) -> NoReturn:
        found = selectors[row["selector"]](run, **args)
        ends = "" if found.low is None else f" ({found.low:.3g} to {found.high:.3g})"
        told = f"{f'{found.value:.3g} {unit}'.strip()}{ends}{found.note and '; '}{found.note}"
        raise NotComputed(f"not comparable: {missing}; ours here is {told}")

    if missing:
        return shown if row["selector"] else not_here
    return lambda run: selectors[row["selector"]](run, **args)


# --- verdicts -------------------------------------------------------------------------------------


def judge(claim: Claim, run: StudyRun) -> dict[str, Any]:
    """One row of the table ``against_<paper>``."""
    ours, missing = None, ""
    try:
        ours = claim.ours(run)
    except NotComputed as error:
        missing = str(error)
    verdict = _verdict(claim, ours)
    return {
        "id": claim.id,
        "where": claim.where,
        "quantity": claim.quantity,
        "unit": claim.unit,
        "paper": claim.printed,
        "paper_low": claim.range.low,
        "paper_high": claim.range.high,
        "ours": None if ours is None else ours.value,
        "ours_low": None if ours is None else ours.low,
        "ours_high": None if ours is None else ours.high,
        "limit": claim.range.limit.value,
        "verdict": verdict,
        "reason": _reason(claim, verdict, ours, missing),
        "evidence": claim.evidence and claim.evidence.value,
    }


def _verdict(claim: Claim, ours: Computed | None) -> str:
    """Inside or outside, undecided between them, or why none of these means anything."""
    printed = (claim.range, *claim.also) if claim.also else ()
    disagrees = ours is not None and printed and not any(r.holds(ours.value) for r in printed)
    if claim.contradicted and not disagrees:
        return Evidence.CONTRADICTED.value
    if ours is None:
        return "not_computed"
    held = claim.range.holds(ours.value)
    if held and claim.evidence not in (None, Evidence.INDEPENDENT):
        return str(claim.evidence)
    if _straddles(claim.range, ours):
        return "undecided"
    return "inside" if held else "outside"


def _straddles(printed: Range, ours: Computed) -> bool:
    """Whether a single limit, of order or sign, lies within our own range.

    A range with one end is open at the other. The largest or the least of several that is outside
    is outside wherever the others are: there our value is an end of our range.
    """
    held, ends = printed.holds(ours.value), (ours.low, ours.high)
    if printed.limit is not Limit.ONE_SIDED or ends == (None, None):
        return False
    if not held and ours.value in ends:
        return False
    return any(
        printed.holds(o if e is None else e) != held for e, o in zip(ends, (-inf, inf), strict=True)
    )


def _reason(claim: Claim, verdict: str, ours: Computed | None, missing: str) -> str:
    """What the range is, why ours is outside it or absent, and the notes."""
    told = {
        "outside": [
            _factor(claim, ours),
            claim.contradicted and f"outside of all that the paper prints ({claim.contradicted})",
            claim.outside,
        ],
        "undecided": ["the limit lies within our own range"],
        "contradicted": [f"not compared: {claim.contradicted}", missing],
        "not_computed": [missing],
    }.get(verdict, [])
    compared = "" if verdict == "contradicted" else f"range: {claim.range.what}"
    parts = [compared, *told, claim.note, ours.note if ours else ""]
    return "; ".join(part for part in parts if part)


def _factor(claim: Claim, ours: Computed | None) -> str:
    """Ours in terms of the paper's value, where both are sizes and not a count or yes or no."""
    printed, fixed = claim.printed, claim.range.low == claim.range.high
    if printed is None or ours is None or fixed or printed <= 0.0 or ours.value < 0.0:
        return ""
    return f"ours is {ours.value / printed:.2g} times the paper's"


@cache
def claims_of(paper: str) -> tuple[Claim, ...]:
    """All claims of a paper, in the order of its csv."""
    selectors = selectors_of(paper)
    return tuple(claim_of(row, selectors) for row in rows_of(paper))


def judged(claims: Iterable[Claim], run: StudyRun) -> list[dict[str, Any]]:
    """Rows of the table ``against_<paper>``, in the order of the claims."""
    return [judge(claim, run) for claim in claims]


def compare(
    paper: str, tables: Mapping[str, pd.DataFrame], asked: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """All rows of a paper, in the order of its csv."""
    return judged(claims_of(paper), StudyRun(tables, asked))
