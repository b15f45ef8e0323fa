"""Advice in sentences, and the rows of it that a page shows."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from spinepipe.report.words import count, number
from spinepipe.studies.discrepancy.words import readable

MOST_SHOWN = 5
"""Runs of each subject on a page; all are in design.csv."""

SHOWN = ("advised", "offered", "would_do")


def shown_advice(next_tests: pd.DataFrame) -> pd.DataFrame:
    """The first rows of each subject that would tell something, in plain words."""
    rows = next_tests[next_tests["status"].isin(SHOWN)] if len(next_tests) else next_tests
    if rows.empty:
        return rows
    first = rows.groupby("effect_or_pair", sort=False).head(MOST_SHOWN)
    told = {name: first[name].map(readable) for name in ("effect_or_pair", "test", "message")}
    return first.assign(**told)


def advice_sentences(next_tests: pd.DataFrame) -> list[str]:
    """The advised test of each subject; nothing where there is no advice."""
    if next_tests.empty:
        return []
    rows = next_tests[next_tests["status"] == "advised"]
    return [_sentence(row) for row in rows.to_dict("records")] + _in_vain(next_tests)


def _sentence(row: Mapping[Any, Any]) -> str:
    subject, test = readable(row["effect_or_pair"]), readable(row["test"])
    gain = number(float(row["gain_in_log_evidence"]), 2)
    cycles = int(row["cycles"])
    if row["message"].startswith("withheld"):
        return (
            f"{subject.capitalize()} is not named, as it is no larger than the imperfections "
            f"allowed for: {readable(str(row['message']))}."
        )
    each = count(cycles, "cycle")
    return f"Next test for {subject}: {test}; expected gain in log evidence {gain} in {each}."


def _in_vain(next_tests: pd.DataFrame) -> list[str]:
    """Subjects for which no run of the menu tells anything."""
    helped = next_tests[next_tests["status"].isin(SHOWN)]["effect_or_pair"]
    left = next_tests[~next_tests["effect_or_pair"].isin(helped)]["effect_or_pair"].unique()
    return [f"No single test that was tried would tell more of {readable(one)}." for one in left]
