"""What a search could not tell, or hardly: names alike, gaps too small, effects without a trace."""

import pandas as pd

from spinepipe.report.discrepancy.verdict import Answer, Verdict
from spinepipe.report.discrepancy.words import listed, plain, readable, with_article
from spinepipe.report.words import number

_MOST_EASY, _MOST_HARD, _MOST_ALIKE, _MOST_TESTS = 4, 3, 2, 3
_ALIKE = 0.3
"""Share of an effect's gap from which another is said to be like it."""


def would_have_been_seen(verdict: Verdict) -> str:
    """Of a search that named nothing: the gaps from which effects would have been named."""
    if verdict.answer is not Answer.NULL or not verdict.smallest_detectable:
        return ""
    ordered = sorted(verdict.smallest_detectable, key=lambda one: one.gap)
    told = [f"{plain(one.name)} {number(one.gap, 2)}" for one in ordered]
    if len(told) <= _MOST_EASY + _MOST_HARD:
        return f"Smallest gap, in noise SD, that would have been named: {', '.join(told)}."
    return (
        f"Smallest gap, in noise SD, that would have been named: {', '.join(told[:_MOST_EASY])} "
        f"are the easiest to see; {', '.join(told[-_MOST_HARD:])} the hardest. "
        "A table below has all."
    )


def confused(verdict: Verdict, confusions: pd.DataFrame) -> str:
    """What these tests could take each named effect for."""
    told = []
    for effect in verdict.effects if len(confusions) else ():
        rows = confusions[(confusions["effect"] == effect.name) & (confusions["share"] >= _ALIKE)]
        others = rows[rows["other"] != effect.name].sort_values("share", ascending=False)
        alike = [
            f"{with_article(row['other'])} would explain {100.0 * row['share']:.0f} %"
            for row in others.head(_MOST_ALIKE).to_dict("records")
        ]
        if alike:
            told.append(f"{listed(alike)} of the gap that {plain(effect.name)} makes")
    return f"What it could be taken for with these tests: {'; '.join(told)}." if told else ""


def imitating(verdict: Verdict, candidates: pd.DataFrame) -> str:
    """Of what no known effect explains: the one that comes nearest, and why it is not named."""
    unknown = verdict.answer is Answer.UNKNOWN and verdict.unknown_shape in verdict.why
    if not unknown or not verdict.unknown_shape or verdict.effects or candidates.empty:
        return ""
    rows = candidates[candidates["stage"] == "refit 1"].dropna(subset="log_evidence")
    if rows.empty or verdict.threshold is None:
        return ""
    best = max(rows.to_dict("records"), key=lambda row: row["log_evidence"])
    if best["log_evidence"] <= verdict.threshold:
        return ""
    return (
        f"Nearest known effect: {plain(best['effect'])}, log evidence "
        f"{number(best['log_evidence'])}. Generic shapes without physics explain much more, so it "
        "would only imitate what is missing."
    )


def not_testable(verdict: Verdict) -> str:
    """Effects without a trace in these tests, and the tests that would show them."""
    names = [plain(one.name) for one in verdict.not_testable]
    if not names:
        return ""
    told = f"These tests cannot show {listed(names, 8, 'or')}"
    if verdict.answer is Answer.NULL:
        told += ", so nothing is said about them"
    by_test: dict[str, list[str]] = {}
    for one in verdict.not_testable:
        by_test.setdefault(readable(one.test_that_would_tell), []).append(plain(one.name))
    would = [
        f"{listed(shown, 8)}: {test}" for test, shown in list(by_test.items())[:_MOST_TESTS] if test
    ]
    return f"{told}. What would show them: {'; '.join(would)}." if would else f"{told}."
