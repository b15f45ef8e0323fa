"""Why an effect is named, or why not: what `spinepipe why STUDY EFFECT` says of it."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from spinepipe.problems import InputError, did_you_mean, one_of
from spinepipe.studies.discrepancy.alternatives import USEFUL, run_in_words
from spinepipe.studies.discrepancy.tables import CANDIDATES, NEXT_TESTS
from spinepipe.studies.discrepancy.verdict import LEAST_PROBABLE, SURE, Verdict, read_verdict
from spinepipe.studies.discrepancy.words import general
from spinepipe.studies.exports import problem, required_result
from spinepipe.tables import read

Row = Mapping[str, Any]

FOLDER = "discrepancy"
MOST_RIVALS = 3


def why(results: Path, effect: str) -> Iterator[str]:
    """A few lines: how probable, its best form, what is ahead of it, and what would tell.

    Raises
    ------
    InputError
        Where the study has no results, or none of an effect of that name.
    """
    folder = results / FOLDER
    verdict = read_verdict(required_result(folder / "verdict.json", "name another study"))
    tried, next_tests = (
        read(folder / f"{name}.parquet").to_pylist() for name in (CANDIDATES.name, NEXT_TESTS.name)
    )
    names = sorted({row["effect"] for row in tried} | {one.name for one in verdict.not_testable})
    if effect not in names:
        remedy = did_you_mean(effect, names, "choose one of them")
        raise InputError([problem("EFFECT", f"'{effect}'", one_of(names), remedy)])
    yield from _lines(verdict, effect, tried, next_tests)


def _lines(
    verdict: Verdict, effect: str, tried: Sequence[Row], next_tests: Sequence[Row]
) -> Iterator[str]:
    yield f"Verdict: {verdict.verdict}. {verdict.why}"
    probable = verdict.probabilities
    own = f"{probable[effect]:.2f}" if effect in probable else f"below {LEAST_PROBABLE:g}"
    yield f"Probability that {general(effect)} is missing: {own}; a name needs {SURE:g}."
    ahead = sorted(((p, name) for name, p in probable.items() if name != effect), reverse=True)
    others = ", ".join(f"{general(name)} {p:.2f}" for p, name in ahead[:MOST_RIVALS])
    yield f"Others: {others}." if others else "No other is probable."
    for blind in (one for one in verdict.not_testable if one.name == effect):
        yield f"These tests cannot show it: {blind.why}."
        if blind.test_that_would_tell:
            yield f"This would: {run_in_words(blind.test_that_would_tell)}."
    rows = [row for row in tried if row["effect"] == effect and row["log_evidence"] is not None]
    for kind, words in (("refit", "Best fit"), ("screen", "Best look, to first order")):
        of_kind = [row for row in rows if row["stage"].startswith(kind)]
        for best in sorted(of_kind, key=lambda row: -row["log_evidence"])[:1]:
            options = ", ".join(f"{k} {v}" for k, v in json.loads(best["variant"]).items())
            beside = f" beside {best['beside']}" if best["beside"] else ""
            yield (
                f"{words}{beside}: {options or 'no options'}, {best['spread']}: "
                f"log evidence {best['log_evidence']:.1f}; {best['decision']}."
            )
    for one in (o for o in verdict.smallest_detectable if o.name == effect):
        yield f"It is found in nine data sets of ten from a misfit of {one.gap:.2f} noise SD on."
    about = (row for row in next_tests if effect in row["effect_or_pair"].split(" or "))
    runs = [row for row in about if row["status"] in USEFUL and row["cycles"] > 0]
    for best in sorted(runs, key=lambda row: -row["gain_per_cycle"])[:1]:
        gain = f"{best['gain_in_log_evidence']:.1f} log evidence"
        yield f"What would tell: {run_in_words(best['test'])} ({gain} expected)."
