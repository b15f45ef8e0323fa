"""Which tables the page of a search shows: those of the verdict, then those of the files."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from spinepipe.report.discrepancy.file_tables import file_tables
from spinepipe.report.discrepancy.verdict import Missing, Verdict
from spinepipe.report.discrepancy.words import (
    called,
    differing,
    name_and_place,
    plain,
    readable,
    unit_of,
    value_of,
    where_of,
)
from spinepipe.report.page.results import Results
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.tables.schema import Column

Records = list[dict[str, Any]]

_EFFECT = Column("effect", "text", "effect")
_COLUMNS: Mapping[str, tuple[Column, ...]] = {
    "parameters": (
        _EFFECT,
        Column("parameter", "text", "parameter of the effect"),
        Column("value [95 % interval]", "text", "estimate, and the interval if there is one"),
        Column("unit", "text", "unit; none for a ratio"),
        Column("place", "text", "joints, coordinates, specimens and tests it is of"),
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
    found += [sortable(*parts) for parts in file_tables(results) if len(parts[3])]
    return [table for table in found if table.rows]


def _from_verdict(verdict: Verdict) -> dict[str, Records]:
    return {
        "errors": [
            {key: readable(words) for key, words in vars(one).items()}
            for one in verdict.suspicions
        ],
        "parameters": [
            {"effect": called(effect), "parameter": name_and_place(one)[0],
             "value [95 % interval]": value_of(one), "unit": unit_of(one.unit),
             "place": _place(effect, name_and_place(one)[1])}
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
        "not_testable": [
            {"effect": plain(one.name), "why": readable(one.why),
             "test_that_would_tell": readable(one.test_that_would_tell)}
            for one in verdict.not_testable
        ],
        "detectable": [
            {"effect": plain(one.name), "gap": one.gap}
            for one in sorted(verdict.smallest_detectable, key=lambda one: one.gap)
        ],
    }  # fmt: skip


def _place(effect: Missing, own: str) -> str:
    """Where a value holds: where the effect is, and the places of its own or how values differ."""
    return "; ".join(part for part in (where_of(effect), own or differing(effect)) if part)
