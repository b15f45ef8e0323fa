"""Which tables the page of a search shows: those of the verdict, then those of the files."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.report.discrepancy.verdict import Verdict
from spinepipe.report.discrepancy.words import plain, where_of
from spinepipe.report.page.results import Results
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.tables import CANDIDATES, HELD_OUT, WHERE
from spinepipe.tables.schema import Column

Records = list[dict[str, Any]]

_EFFECT = Column("effect", "text", "effect, as in a model file")
_COLUMNS: Mapping[str, tuple[Column, ...]] = {
    "parameters": (
        _EFFECT,
        Column("where", "text", "joints, coordinates, specimens and tests"),
        Column("parameter", "text", "parameter of the effect"),
        Column("value", "number", "estimate", null="not known"),
        Column("low", "number", "lower end of the 95 % interval", null="none"),
        Column("high", "number", "upper end of the 95 % interval", null="none"),
        Column("unit", "text", "unit"),
    ),
    "rivals": (
        _EFFECT,
        Column("rival", "text", "another name for the same discrepancy"),
        Column("margin", "number", "log evidence by which it is behind", null="not told"),
    ),
    "set": (
        _EFFECT,
        Column("kind", "text", "what it acts on"),
        Column("where", "text", "joints, coordinates, specimens and tests"),
        Column("log_evidence", "number", "log evidence against the model without it", null="none"),
    ),
    "not_testable": (
        _EFFECT,
        Column("why", "text", "why these tests cannot show it"),
        Column("test_that_would_tell", "text", "what a test must have to show it"),
    ),
    "detectable": (
        _EFFECT,
        Column("gap", "number", "smallest gap at which it would be named", "noise SD"),
    ),
    "errors": (
        Column("where", "text", "readings in question"),
        Column("what", "text", "what it looks like"),
        Column("evidence", "text", "why"),
    ),
}
_TITLES = {
    "errors": ("Suspected errors of the data", "Readings that no model should be bent to."),
    "parameters": ("What is missing, and how large it is", "Parameters of the named effects."),
    "set": ("One of these is missing", "Effects that these tests cannot tell apart."),
    "rivals": ("Next best names", "Log evidence below a few units is too little to decide."),
    "not_testable": ("What these tests cannot show", "Base or nuisance take it up."),
    "detectable": ("What would have been seen", "A smaller gap may be there unseen."),
}
"""Tables from the verdict in their order: title, and what is said of each."""


def shown_tables(verdict: Verdict, results: Results) -> list[Sortable]:
    """Tables with rows, those that say most first."""
    made = _from_verdict(verdict)
    found = [
        sortable("verdict", *_TITLES[name], pd.DataFrame(made[name]), _COLUMNS[name])
        for name in _TITLES
        if made[name]
    ]
    found += [sortable(*parts) for parts in _from_files(results) if len(parts[3])]
    return [table for table in found if table.rows]


def _from_verdict(verdict: Verdict) -> dict[str, Records]:
    return {
        "errors": [vars(one) for one in verdict.suspicions],
        "parameters": [
            {"effect": plain(effect.name), "where": where_of(effect),
             "parameter": plain(one.name), "value": one.value, "low": one.low, "high": one.high,
             "unit": one.unit}
            for effect in verdict.effects for one in effect.parameters
        ],
        "set": [
            {"effect": plain(one.name), "kind": one.kind, "where": where_of(one),
             "log_evidence": one.log_evidence}
            for one in verdict.candidates
        ],
        "rivals": [
            {"effect": plain(effect.name), "rival": plain(rival.name), "margin": rival.margin}
            for effect in verdict.effects for rival in effect.rivals
        ],
        "not_testable": [vars(one) | {"effect": plain(one.name)} for one in verdict.not_testable],
        "detectable": [
            {"effect": plain(one.name), "gap": one.gap}
            for one in sorted(verdict.smallest_detectable, key=lambda one: one.gap)
        ],
    }  # fmt: skip


def _from_files(
    results: Results,
) -> Iterator[tuple[str, str, str, pd.DataFrame, tuple[Column, ...]]]:
    held_out, where = results.table("held_out"), results.table("where")
    yield "held_out", "Held-out proof", HELD_OUT.about, held_out, HELD_OUT.columns
    if len(where):
        ordered = where[where["by"] != "step"].sort_values("gap", ascending=False, kind="stable")
        yield "where", "Where the models are off", WHERE.about, ordered, WHERE.columns
    candidates = results.table("candidates")
    if len(candidates):
        rows = candidates[candidates["log_evidence"].notna()]
        ordered = rows.sort_values("log_evidence", ascending=False, kind="stable")
        about = f"{CANDIDATES.about} Best first; rows without evidence are in candidates.parquet."
        yield "candidates", "What was tried", about, ordered, CANDIDATES.columns
