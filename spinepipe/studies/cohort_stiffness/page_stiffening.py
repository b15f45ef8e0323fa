"""Key findings about joints that stiffen: do they predict better what was not fitted?"""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import number, percent
from spinepipe.studies.cohort_stiffness.claims_of_errors import CONTESTS
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS, SHARED, STIFFENING
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import (
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    joint_label_of,
)

_HELD_OUT = {LEFT_OUT_CASE: "a left-out load case", LEFT_OUT_SPECIMEN: "a left-out specimen"}

_VERDICTS = {
    "yes": "is predicted better",
    "no": "is predicted worse",
    "undecided": "is not shown to be predicted better",
}


def stiffening(study: CohortStiffness, results: ResultTables) -> Iterator[str]:
    """Laws that stiffen beside their linear counterparts, and whether the data hold them."""
    rows = results.table("findings")
    for better, worse in CONTESTS:
        if len(rows) and better in STIFFENING and worse not in STIFFENING:
            criterion = _akaike(better, worse, results.table("ranking"))
            yield from _worth(better, worse, rows.set_index("finding"), criterion)
    yield from _held(results.table("stiffness"))


def _akaike(better: str, worse: str, ranking: pd.DataFrame) -> str:
    """Which of the two Akaike's criterion prefers, of what was fitted; empty without values."""
    if ranking.empty:
        return ""
    values = ranking[ranking["criterion"] == "aicc"].set_index("representation")["value"].dropna()
    if not {better, worse} <= set(values.index):
        return ""
    less = float(values[worse] - values[better])
    name = "the law that stiffens" if less > 0.0 else "the linear one"
    by = number(abs(less), 2)
    return f" Of the motion that was fitted Akaike's criterion prefers {name}, by {by}."


def _worth(better: str, worse: str, claims: pd.DataFrame, criterion: str) -> Iterator[str]:
    """What held-out motion says of one law against the linear one, and a criterion beside it."""
    names = {stage: f"{better}_beats_{worse}_{stage}" for stage in _HELD_OUT}
    asked = {
        stage: claims.loc[name].to_dict()
        for stage, name in names.items()
        if name in claims.index and claims.loc[name, "holds"] in _VERDICTS
    }
    if not asked:
        return
    holds = {row["holds"] for row in asked.values()}
    verdict = "Not shown"
    if "no" in holds:
        verdict = "No" if "yes" not in holds else "It hangs on what is held out"
    elif "yes" in holds:
        verdict = "Yes"
    told = "; ".join(f"{_HELD_OUT[stage]} {_told(row)}" for stage, row in asked.items())
    names_of = f"\u201c{IN_WORDS[better]}\u201d against \u201c{IN_WORDS[worse]}\u201d"
    yield (
        f"Do joints that stiffen predict better what was not fitted? {verdict}. With {names_of} "
        f"{told}.{criterion}"
    )


def _told(row: dict[Any, Any]) -> str:
    """Verdict, difference of the errors and p that decides."""
    words = _VERDICTS[row["holds"]]
    if pd.isna(row["value"]):
        return f"{words} ({row['message']})"
    less = f"error less by {number(row['value'], 2)} {row['unit']}"
    ends = "" if pd.isna(row["low"]) else f", {number(row['low'], 2)} to {number(row['high'], 2)}"
    p = "" if pd.isna(row["p_holm"]) else f", p {number(row['p_holm'], 2)} beside the other claims"
    return f"{words} ({less}{ends}{p})"


def _held(stiffness: pd.DataFrame) -> Iterator[str]:
    """In how many joints a linear law is excluded, and what stiffness then means."""
    if stiffness.empty:
        return
    own = stiffness[stiffness["fitted_to"] == joint_label_of(stiffness)]
    own = own[(own["source"] == "own") & own["growth"].notna()]
    parts, left = [], 0
    for name, part in own.groupby("representation", sort=False):
        if name in SHARED:  # one law of all joints
            part = part.drop_duplicates(["specimen", "coordinate"])
        excluded, total = int((part["growth_low"].astype(float) > 0.0).sum()), len(part)
        left += total - excluded
        share = f"{excluded} of {total} laws ({percent(excluded, total)})"
        parts.append(f"{IN_WORDS[str(name)]}: {share}")
    if parts:
        rest = " Of the others the data do not tell whether they stiffen." if left else ""
        yield (
            f"A linear joint is excluded, each law by itself at 95 %: {'; '.join(parts)}.{rest} "
            "Stiffness of these laws is that at rest."
        )
