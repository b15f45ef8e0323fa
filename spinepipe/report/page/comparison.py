"""A page of its own for each paper: its numbers beside ours, the strongest evidence first.

Only numbers whose column ``evidence`` is ``independent`` are counted: cohort and study were not
made to have them, so that agreement could have failed. What it takes to agree, the column ``limit``
says. Codes of both columns stay in the files; the page has words for them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.study_page import rendered, tag
from spinepipe.report.page.tables import Sortable, sortable
from spinepipe.report.words import plain
from spinepipe.schema import Table
from spinepipe.studies.study import Study

AGAINST = "against_"
"""How tables begin that set a paper's numbers beside ours."""

VERDICTS = {
    "inside": "reproduced",
    "outside": "not reproduced",
    "undecided": "undecided",
    "not_computed": "not comparable",
}
"""What can come of a number that is evidence; all but the last were compared."""

LIMITS = {
    "two_sided": "range of the paper",
    "chosen": "chosen width",
    "borrowed": "borrowed tolerance",
    "wide": "wide range",
    "one_sided": "single limit",
    "binary": "yes, no or count",
    "none": "nothing to compare",
}
"""What a number is compared with, the strongest evidence first."""

STRONG = "two_sided"

LINES = (
    ("Range of the paper", (STRONG,), "Two ends; the paper gives their distance."),
    ("Width chosen here", ("chosen",), "The paper gives no width."),
    ("Borrowed tolerance", ("borrowed",), "The paper gives it for another quantity."),
    ("Weak evidence", ("wide", "one_sided", "binary", "none"), ""),
)
"""Lines below the answer: what they begin with, kinds of limit, and what they end with."""

NO_EVIDENCE = {
    "circular": "the cohort or the study was made to have",
    "recomputed": "follow from other numbers of the paper",
    "contradicted": "other numbers of the paper exclude",
    "": "no run has anything to set beside",
}
"""Values of the column ``evidence`` of which agreement shows nothing, and why it does not."""

_ORDER = (
    *("quantity", "verdict", "limit", "unit", "paper", "paper_low", "paper_high"),
    *("ours", "ours_low", "ours_high", "reason", "where", "evidence"),
)
"""Columns of the page: what came of it stands first. The key, a short name of each quantity,
is left to the file.
"""


def paper_of(table: str) -> str:
    """``against_gould_2024b`` is Gould et al. 2024b."""
    first, _, year = table.removeprefix(AGAINST).partition("_")
    return f"{first.capitalize()} et al. {year}"


def comparison(shape: Table, title: str, rows: pd.DataFrame, study: Study, cohort: Cohort) -> str:
    """The page of a table ``against_*``: how many of its numbers agree, then all of them.

    Parameters
    ----------
    shape : the table as it is declared. rows : at least one.
    """
    evidence = rows[_independent(rows)]
    said = answer(evidence)
    first, rest = tables_of(shape, title, rows)
    return rendered(
        "comparison.html",
        title=f"{study.study}: {said}",
        study=study.study,
        tag=tag(cohort.made_up, cohort.rebuilt),
        heading=title,
        answer=said,
        lines=list(lines(evidence)),
        first=first,
        rest=rest,
    )


def _independent(rows: pd.DataFrame) -> "pd.Series[bool]":
    return rows["evidence"] == "independent"


@dataclass(frozen=True)
class Counts:
    """How many numbers had each verdict, by its code."""

    of: dict[str, int]

    @classmethod
    def made(cls, rows: pd.DataFrame, *limits: str) -> "Counts":
        """Of those rows that are compared with such limits."""
        found = rows.loc[rows["limit"].isin(limits), "verdict"]
        return cls({code: int((found == code).sum()) for code in VERDICTS})

    @property
    def reproduced(self) -> str:
        """``8 of 28``: of those that were compared."""
        return f"{self.of['inside']} of {self.compared}"

    @property
    def compared(self) -> int:
        """How many have anything of ours beside them."""
        return sum(self.of.values()) - self.of["not_computed"]

    def __str__(self) -> str:
        """All that are not zero: ``8 reproduced, 20 not reproduced``."""
        return ", ".join(f"{n} {VERDICTS[code]}" for code, n in self.of.items() if n)


def answer(evidence: pd.DataFrame) -> str:
    """How many numbers agree, in one sentence; those within a range of the paper apart."""
    if evidence.empty:
        return "No number of the paper is independent evidence for this study."
    strong = Counts.made(evidence, STRONG)
    weaker = Counts.made(evidence, *(limit for limit in LIMITS if limit != STRONG))
    if not strong.compared and not weaker.compared:
        return f"None of {len(evidence)} independent numbers can be compared with this study."
    if not strong.compared:
        return (
            "No number that the paper gives a range for can be compared; by weaker comparisons "
            f"this study reproduces {weaker.reproduced}."
        )
    rest = f", and {weaker.reproduced} by weaker comparisons" if weaker.compared else ""
    return (
        f"This study reproduces {strong.reproduced} numbers that the paper gives a range for{rest}."
    )


def lines(evidence: pd.DataFrame) -> Iterator[tuple[str, str, str]]:
    """Heading, counts and a remark of each strength of evidence that there is, strongest first."""
    for heading, limits, remark in LINES:
        counts = Counts.made(evidence, *limits)
        kinds = {LIMITS[one]: Counts.made(evidence, one) for one in limits if len(limits) > 1}
        parts = [f"{name} {kind.reproduced}" for name, kind in kinds.items() if kind.compared]
        if str(counts):
            yield heading, f"{counts}.", f"Reproduced: {'; '.join(parts)}." if parts else remark


def tables_of(
    shape: Table, title: str, rows: pd.DataFrame
) -> tuple[Sortable | None, Sortable | None]:
    """Numbers that are evidence, by its strength, and those that are none; None without rows."""
    strength = {limit: place for place, limit in enumerate(LIMITS)}
    shown = rows.sort_values("limit", key=lambda names: names.map(strength), kind="stable")
    shown = shown.assign(
        quantity=shown["quantity"].map(plain),
        limit=shown["limit"].map(LIMITS),
        verdict=shown["verdict"].replace(VERDICTS),
    )
    meanings = {
        "limit": "what it takes to agree, the strongest first",
        "verdict": "whether ours agrees; undecided: our own range reaches over the limit",
    }
    columns = [
        replace(column, meaning=meanings.get(column.name, column.meaning))
        for column in map(shape.column, _ORDER)
    ]
    counted = _independent(shown)
    about = "One row per published number, the strongest evidence first."
    told = shown[counted].drop(columns="evidence")
    first = sortable(shape.name, title, about, told, columns)
    others = shown[~counted]
    rest = sortable(shape.name, f"{title}: no evidence", _why_none(rows), others, columns)
    return first if first.rows else None, rest if rest.rows else None


def _why_none(rows: pd.DataFrame) -> str:
    """Why the numbers that are no evidence are none, and how many ours is outside of all the same.

    Who fails to meet a number that was put in has something to explain.
    """
    kinds = rows["evidence"].fillna("")
    told = [f"{n} {why}" for kind, why in NO_EVIDENCE.items() if (n := int((kinds == kind).sum()))]
    missed = int((~_independent(rows) & (rows["verdict"] == "outside")).sum())
    still = f" {missed} of them are not reproduced all the same." if missed else ""
    return f"Numbers of which agreement shows nothing: {'; '.join(told)}.{still}"
