"""The report of a search: its verdict first, then tables of the result files in plain words.

Two models are compared: the base, which is asked what it lacks, and the base with the effects that
the verdict names. Words (``docs/glossary.md``): the gap is the misfit above the noise,
``sqrt(chi2 / dof - 1)`` in noise SD; log evidence is the natural logarithm of how much likelier
the readings are with an effect than without it; held out is motion that was left out of the fits
that predict it.
"""

import json
from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, Headline, ResultTables
from spinepipe.report.page.tables import Sortable, sortable
from spinepipe.report.words import listed, plain
from spinepipe.schema import Column
from spinepipe.studies.discrepancy.field_tables import (
    FORMULA_ABOUT,
    NUMBERS_ABOUT,
    TABULATED_ABOUT,
    WITHHELD_ABOUT,
    formula_table,
    numbers_table,
    tabulated_table,
    withheld_table,
)
from spinepipe.studies.discrepancy.findings import (
    USEFUL,
    findings,
    headline,
    how_sure,
    warnings,
)
from spinepipe.studies.discrepancy.quantities import estimate, quantities
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import CANDIDATES, HELD_OUT, NEXT_TESTS, WHERE
from spinepipe.studies.discrepancy.verdict import EVERY, Conclusion, Missing, Verdict, read_verdict
from spinepipe.studies.discrepancy.words import (
    general,
    label_of,
    motion_of,
    name_at,
    readable,
    spread_words,
    where_of,
)

Parts = tuple[str, str, str, pd.DataFrame, tuple[Column, ...]]
"""Of one table of the page: the result file that it is made of, by its name without an ending; its
title; what is said of it; rows; columns.
"""

_TRIED = (
    "stage",
    "effect",
    "variant",
    "spread",
    "scope",
    "estimate",
    "unit",
    "log_evidence",
    "delta_chi2",
    "gap_share",
    "message",
)
"""Columns of `CANDIDATES` that are shown; the others are in candidates.parquet."""

_PROOF = (
    *("fold", "kind", "readings"),
    *(f"gap_{model}{end}" for model in ("base", "with_effects") for end in ("", "_low", "_high")),
    *("gap_surrogate", "closed", "gap_closed", "worse", "message"),
)
"""Columns of `HELD_OUT` that are shown, among them the gaps of both models with their intervals.

Root mean square residuals, and the interval of the surrogate's gap (a generic model
without physics, for comparison), are in held_out.parquet.
"""

_ONE_PLACE = "joint x coordinate x test"
"""Value of the column ``by`` of the table `WHERE` for single places: nothing is pooled over them
but specimens and load steps.
"""

_WHERE = (
    f"{WHERE.about} Largest first; of single places those above the noise. All of them, and load "
    "steps, are in where.parquet."
)
_NEXT = f"{NEXT_TESTS.about} The first of each; all of them are in design.csv."
_CANDIDATES = (
    f"{CANDIDATES.about} On each screen the best form of an effect; all forms are in "
    "candidates.parquet."
)

_MOST_RUNS = 5
"""Further tests shown of each question (an effect, two names, what has none): the first ones, which
tell most per cycle. All are in design.csv.
"""

QUESTION = (
    "Where do model and measurement disagree, which effect does the model lack, what happens when "
    "it is added, and how sure is that?"
)
READ = (
    *("where", "candidates", "held_out", "confusions", "next_tests"),
    *("field_numbers", "tabulated"),
)
"""Tables whose rows the page needs. Of the other tables it tells only where they come from: code,
settings and data.
"""


def document(study: Discrepancy, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    verdict = read_verdict(results.tables.files["verdict"])
    # where nothing is missing, the figure of what these tests could have shown comes first
    first = "effect_confusions" if verdict.verdict is Conclusion.NULL else ""
    pictures = sorted(results.pictures.values(), key=lambda picture: picture.name != first)
    # no line break between a number and its per cent sign
    sure = how_sure(verdict).replace(" %", "\u00a0%")
    return Document(
        question=QUESTION,
        findings=findings(verdict, results),
        pictures=pictures,
        tables=page_tables(verdict, results),
        metadata=results.metadata,
        left_out=tuple(left_out(study)),
        headline=Headline(headline(verdict, results.table("where")), sure, warnings(verdict)),
    )


def page_tables(verdict: Verdict, results: ResultTables) -> list[Sortable]:
    """Tables with rows, those that say most first: what the verdict names, then what it does not,
    then result files. Tables without rows are left out.
    """
    first, last = _named_tables(verdict), _other_tables(verdict)
    parts = (*first, *in_field_units(verdict, results), *last, *file_tables(results))
    found = [sortable(*one) for one in parts if len(one[3])]
    return [table for table in found if table.rows]


def _named_tables(verdict: Verdict) -> Iterator[Parts]:
    """What the verdict says of errors of the data, and of the effects that it names or that tie."""
    yield _table(
        "Suspected errors of the data",
        "Readings that no model should be bent to.",
        (
            Column("where", "text", "readings in question"),
            Column("what", "text", "what it looks like"),
            Column("evidence", "text", "why"),
        ),
        [
            (readable(one.where), readable(one.what), readable(one.evidence))
            for one in verdict.suspected_data_errors
        ],
    )
    yield _table(
        "What is missing, and how large it is",
        "Parameters of the named effects, with all that the readings allow where everything else "
        "is fitted anew. Where an end is open, the value is not known.",
        (
            _EFFECT,
            Column("parameter", "text", "parameter of the effect"),
            Column(
                "value [95 % interval]", "text", "estimate and interval, or the end that is known"
            ),
            Column("unit", "text", "unit; none for a ratio"),
            Column("place", "text", "joints, coordinates, specimens and tests it is of"),
        ),
        [
            (label_of(effect), one.name, one.in_brackets, one.unit, _place(effect, one.place))
            for effect in verdict.effects
            for one in quantities(effect)
        ],
    )
    yield _table(
        "One of these is missing",
        "Effects that these tests cannot tell apart.",
        (
            _EFFECT,
            Column("where", "text", "coordinates that it would load; none where it names none"),
            Column("behind", "text", "log evidence by which it is behind the likeliest"),
        ),
        [
            (
                name_at(one.name, one.coordinates),
                "" if one.coordinates == EVERY else listed(map(plain, one.coordinates)),
                "not told" if one.behind is None else f"{one.behind:.1f}",
            )
            for one in verdict.in_set
        ],
    )


_EFFECT = Column("effect", "text", "effect")


def _table(title: str, about: str, columns: tuple[Column, ...], rows: Sequence[Any]) -> Parts:
    frame = pd.DataFrame(rows, columns=[column.name for column in columns])
    return "verdict", title, about, frame, columns


def _place(effect: Missing, own: str) -> str:
    """Where a value holds, in words.

    First where the effect acts; then ``own``, the joint, specimen or test of this one value, or if
    it has none how the effect's values may differ between places.
    """
    return "; ".join(part for part in (where_of(effect), own or spread_words(effect)) if part)


def _other_tables(verdict: Verdict) -> Iterator[Parts]:
    """What the verdict says of the effects that it does not name.

    Rivals of those that it names; effects that these tests cannot show at all; and, of those that
    they can, the smallest gap at which each would have been found.
    """
    yield _table(
        "Next best names",
        "Log evidence below a few units is too little to decide.",
        (
            _EFFECT,
            Column("rival", "text", "another name for the same discrepancy"),
            Column("margin", "number", "log evidence by which it is behind"),
        ),
        [
            (label_of(effect), general(rival.name), rival.log_evidence_margin)
            for effect in verdict.effects
            for rival in effect.rivals
        ],
    )
    yield _table(
        "What these tests cannot show",
        "Base or nuisance take it up.",
        (
            _EFFECT,
            Column("why", "text", "why these tests cannot show it"),
            Column("test_that_would_tell", "text", "what a test must have to show it"),
        ),
        [
            (
                general(one.name),
                readable(one.why),
                readable(one.test_that_would_tell) or "none of those tried",
            )
            for one in verdict.not_testable
        ],
    )
    yield _table(
        "What would have been seen",
        "A smaller gap may be there unseen.",
        (
            _EFFECT,
            Column("gap", "number", "smallest gap at which it would be found", "noise SD"),
            Column("by_name", "text", "the same, told from every other effect", "noise SD"),
        ),
        [
            (general(one.name), one.gap, "never" if one.by_name is None else f"{one.by_name:.2f}")
            for one in sorted(verdict.smallest_detectable, key=lambda one: one.gap)
        ],
    )


def in_field_units(verdict: Verdict, results: ResultTables) -> Iterator[Parts]:
    """Tables in the field's units (N m/deg, N/mm).

    First numbers of the curves with the effects. The others describe a misfit that has no name, as
    a formula and as a table, and effects that could be imperfections of the set-up as well.
    """
    told = verdict.part or verdict.unknown
    formula = None if told is None else told.formula
    numbers = numbers_table(results.table("field_numbers"))
    which = "" if verdict.effects else " Of the likeliest of those that cannot be told apart."
    title = "What a tester reads off the curves"
    yield "field_numbers", title, NUMBERS_ABOUT + which, *numbers
    # how much all terms of the formula explain together, as shares of chi2 above the noise: of the
    # readings that were fitted, and of those left out
    share = ""
    if formula is not None:
        explained = f"{100.0 * formula.explained:.0f}\u00a0%"
        share = f" Together {explained} of the excess misfit (chi squared)"
        if formula.held_out_closed is not None:
            closed = f"{100.0 * formula.held_out_closed:.0f}\u00a0%"
            share += f", and {closed} of that of readings left out"
        share += "."
    title = "A formula in the place of a name"
    yield "verdict", title, FORMULA_ABOUT + share, *formula_table(formula)
    table = tabulated_table(results.table("tabulated"))
    yield "tabulated", "A table in the place of a name", TABULATED_ABOUT, *table
    title = "Hidden by imperfections"
    yield "verdict", title, WITHHELD_ABOUT, *withheld_table(verdict.withheld)


def file_tables(results: ResultTables) -> Iterator[Parts]:
    """Tables of the result files, in plain words."""
    runs = results.table("next_tests")
    runs = runs[runs["status"].isin(USEFUL)] if len(runs) else runs
    if len(runs):
        first = runs.groupby("effect_or_pair", sort=False).head(_MOST_RUNS)
        words = {name: first[name].map(readable) for name in ("effect_or_pair", "test", "message")}
        yield "next_tests", "Which test next", _NEXT, first.assign(**words), NEXT_TESTS.columns
    proof = tuple(column for column in HELD_OUT.columns if column.name in _PROOF)
    held_out = _worded(results.table("held_out"))
    yield "held_out", "Held-out proof", HELD_OUT.about, held_out, proof

    # without rows of single load steps, and without single places where noise may be all: where
    # the 95 % interval of the gap begins at 0
    where = results.table("where")
    if len(where):
        above = (where["by"] != "step") & ((where["by"] != _ONE_PLACE) | (where["gap_low"] > 0.0))
        worst = where[above].sort_values("gap", ascending=False, kind="stable")
        yield "where", "Where the models are off", _WHERE, _worded(worst), WHERE.columns

    # estimates in the units of the field; where another quantity than the parameter is told (a
    # motion at which stiffness doubles, say), the unit says which
    candidates = results.table("candidates")
    if len(candidates):
        best = _best(candidates)
        told = [
            estimate(row["effect"], json.loads(row["variant"]), row["estimate"], row["unit"])
            for row in best.to_dict("records")
        ]
        values, units = zip(*told, strict=True) if told else ((), ())
        rows = _worded(best.assign(estimate=list(values), unit=list(units)))
        columns = tuple(column for column in CANDIDATES.columns if column.name in _TRIED)
        yield "candidates", "What was tried", _CANDIDATES, rows, columns


def _worded(frame: pd.DataFrame) -> pd.DataFrame:
    """The same rows with effects, tests, coordinates and options in plain words."""
    ways = {
        "effect": general,
        "fold": plain,
        "test": plain,
        "model": plain,
        "coordinate": motion_of,
        "variant": _options,
    }
    return frame.assign(
        **{name: frame[name].map(way) for name, way in ways.items() if name in frame}
    )


def _options(text: str) -> str:
    """Values of an effect's options, which are given as JSON: ``flexion-extension, tangent``."""
    values = [
        name
        for value in json.loads(text).values()
        for name in (value if isinstance(value, list) else [value])
    ]
    return ", ".join(motion_of(str(name)) for name in values)


def _best(candidates: pd.DataFrame) -> pd.DataFrame:
    """Rows with a log evidence: stages in the order of the search, in each the best first.

    A form is a variant of an effect and how its values may differ between places. Of a screen,
    which has many forms of every effect, only the best of each is kept; of other stages all are.
    """
    rows = candidates[candidates["log_evidence"].notna()]
    order = {stage: number for number, stage in enumerate(rows["stage"].unique())}
    ordered = rows.assign(order=rows["stage"].map(order)).sort_values(
        ["order", "log_evidence"], ascending=[True, False], kind="stable"
    )
    again = ordered.duplicated(["stage", "effect"]) & ordered["stage"].str.startswith("screen")
    return ordered[~again]


def left_out(study: Discrepancy) -> Iterator[str]:
    """Parts that the settings leave out, each with the setting that does."""
    # `refit` is no part: it says how left-out readings are predicted
    for part, done in study.held_out:
        if part != "refit" and not done:
            yield f"prediction of left-out {part} (held_out: {part}: false)"
    if study.effects is not None:
        yield f"all effects but {', '.join(study.effects)} (effects)"
    # a nuisance is a small error of the set-up, given as one prior SD; 0 does not allow for it
    for name, size in study.nuisance:
        if not size:
            yield f"nuisance {name} (nuisance: {name}: 0)"
