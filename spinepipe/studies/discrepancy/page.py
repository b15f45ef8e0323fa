"""The report of a search: its verdict first, then tables of the result files in plain words."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import (
    Document,
    Headline,
    Picture,
    ResultTables,
    Sortable,
    sortable,
)
from spinepipe.report.words import listed, plain
from spinepipe.schema import Column
from spinepipe.studies.discrepancy.advice_words import shown_advice
from spinepipe.studies.discrepancy.field_tables import (
    FORMULA_ABOUT,
    NUMBERS_ABOUT,
    TABULATED_ABOUT,
    WITHHELD_ABOUT,
    formula_shown,
    numbers_shown,
    tabulated_shown,
    withheld_shown,
)
from spinepipe.studies.discrepancy.findings import findings, headline, how_sure, warnings
from spinepipe.studies.discrepancy.quantities import estimate, quantities
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import CANDIDATES, HELD_OUT, NEXT_TESTS, WHERE
from spinepipe.studies.discrepancy.verdict import EVERY, Conclusion, Missing, Verdict, read_verdict
from spinepipe.studies.discrepancy.verdict_unnamed import Formula
from spinepipe.studies.discrepancy.words import (
    called,
    differing,
    general,
    motion_of,
    name_at,
    readable,
    where_of,
)

Parts = tuple[str, str, str, pd.DataFrame, tuple[Column, ...]]

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
"""Columns of what was tried; the others are in the file."""

_PROOF = (
    *("fold", "kind", "readings"),
    *(f"gap_{model}{end}" for model in ("base", "with_effects") for end in ("", "_low", "_high")),
    *("gap_surrogate", "closed", "gap_closed", "worse", "message"),
)
"""Columns of the proof; residuals and one more interval are in the file."""

_ONE_PLACE = "joint x coordinate x test"

_WHERE = (
    f"{WHERE.about} Largest first; of single places those above the noise. All of them, and load "
    "steps, are in where.parquet."
)
_NEXT = f"{NEXT_TESTS.about} The first of each; all of them are in design.csv."
_CANDIDATES = (
    f"{CANDIDATES.about} On each screen the best form of an effect; all forms are in "
    "candidates.parquet."
)

Records = list[dict[str, Any]]

_EFFECT = Column("effect", "text", "effect")
_COLUMNS: Mapping[str, tuple[Column, ...]] = {
    "parameters": (
        _EFFECT,
        Column("parameter", "text", "parameter of the effect"),
        Column(
            "value [95 % interval]",
            "text",
            "estimate and interval, or the end that is known",
        ),
        Column("unit", "text", "unit; none for a ratio"),
        Column("place", "text", "joints, coordinates, specimens and tests it is of"),
    ),
    "rivals": (
        _EFFECT,
        Column("rival", "text", "another name for the same discrepancy"),
        Column("margin", "number", "log evidence by which it is behind"),
    ),
    "set": (
        _EFFECT,
        Column("where", "text", "coordinates that it would load; none where it names none"),
        Column("behind", "text", "log evidence by which it is behind the likeliest"),
    ),
    "not_testable": (
        _EFFECT,
        Column("why", "text", "why these tests cannot show it"),
        Column("test_that_would_tell", "text", "what a test must have to show it"),
    ),
    "detectable": (
        _EFFECT,
        Column("gap", "number", "smallest gap at which it would be found", "noise SD"),
        Column("by_name", "text", "the same, told from every other effect", "noise SD"),
    ),
    "errors": (
        Column("where", "text", "readings in question"),
        Column("what", "text", "what it looks like"),
        Column("evidence", "text", "why"),
    ),
}
_TITLES = {
    "errors": ("Suspected errors of the data", "Readings that no model should be bent to."),
    "parameters": (
        "What is missing, and how large it is",
        "Parameters of the named effects, with all that the readings allow where everything else "
        "is fitted anew. Where an end is open, the value is not known.",
    ),
    "set": ("One of these is missing", "Effects that these tests cannot tell apart."),
    "rivals": ("Next best names", "Log evidence below a few units is too little to decide."),
    "not_testable": ("What these tests cannot show", "Base or nuisance take it up."),
    "detectable": ("What would have been seen", "A smaller gap may be there unseen."),
}
"""Tables from the verdict in their order: title, and what is said of each."""

AFTER = "set"
"""Behind this one stand the tables in the field's units."""

QUESTION = (
    "Where do model and measurement disagree, which effect does the model lack, what happens when "
    "it is added, and how sure is that?"
)
READ = (
    *("where", "candidates", "held_out", "confusions", "next_tests"),
    *("field_numbers", "tabulated"),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def document(study: Discrepancy, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    verdict = read_verdict(results.tables.files["verdict"])
    return Document(
        question=QUESTION,
        findings=findings(verdict, results),
        pictures=_ordered(results.pictures, verdict),
        tables=shown_tables(verdict, results),
        metadata=results.metadata,
        left_out=tuple(left_out(study)),
        headline=Headline(
            headline(verdict, results.table("where")), _joined(how_sure(verdict)), warnings(verdict)
        ),
    )


def _ordered(pictures: Mapping[str, Picture], verdict: Verdict) -> list[Picture]:
    """Where nothing is missing, what could have been seen comes first."""
    first = "effect_confusions" if verdict.verdict is Conclusion.NULL else ""
    return sorted(pictures.values(), key=lambda picture: picture.name != first)


def _joined(words: str) -> str:
    """No line ends between a number and its percent sign."""
    return words.replace(" %", "\u00a0%")


def shown_tables(verdict: Verdict, results: ResultTables) -> list[Sortable]:
    """Tables with rows, those that say most first."""
    made = _from_verdict(verdict)
    found = []
    for name in _TITLES:
        if made[name]:
            rows = pd.DataFrame(made[name])
            found.append(sortable("verdict", *_TITLES[name], rows, _COLUMNS[name]))
        if name == AFTER:
            shown = in_field_units(verdict, results)
            found += [sortable(*parts) for parts in shown if len(parts[3])]
    found += [sortable(*parts) for parts in file_tables(results) if len(parts[3])]
    return [table for table in found if table.rows]


def in_field_units(verdict: Verdict, results: ResultTables) -> Iterator[Parts]:
    """File, title, what is said of it, rows and columns of tables in the field's units."""
    told = verdict.part or verdict.unknown
    formula = None if told is None else told.formula
    numbers = numbers_shown(results.table("field_numbers"))
    which = "" if verdict.effects else " Of the likeliest of those that cannot be told apart."
    title = "What a tester reads off the curves"
    yield "field_numbers", title, NUMBERS_ABOUT + which, *numbers
    title = "A formula in the place of a name"
    yield "verdict", title, FORMULA_ABOUT + _share(formula), *formula_shown(formula)
    table = tabulated_shown(results.table("tabulated"))
    yield "tabulated", "A table in the place of a name", TABULATED_ABOUT, *table
    title = "Hidden by imperfections"
    yield "verdict", title, WITHHELD_ABOUT, *withheld_shown(verdict.withheld)


def _share(formula: Formula | None) -> str:
    """How much the whole formula says, in the fit and held out."""
    if formula is None:
        return ""
    told = f" Together {100.0 * formula.explained:.0f}\u00a0% of the excess misfit (chi squared)"
    if formula.held_out_closed is None:
        return f"{told}."
    return f"{told}, and {100.0 * formula.held_out_closed:.0f}\u00a0% of that of readings left out."


def _from_verdict(verdict: Verdict) -> dict[str, Records]:
    return {
        "errors": [
            {key: readable(words) for key, words in vars(one).items()}
            for one in verdict.suspected_data_errors
        ],
        "parameters": [
            {
                "effect": called(effect),
                "parameter": one.name,
                "value [95 % interval]": one.in_brackets,
                "unit": one.unit,
                "place": _place(effect, one.place),
            }
            for effect in verdict.effects
            for one in quantities(effect)
        ],
        "set": [
            {
                "effect": name_at(one.name, one.coordinates),
                "where": "" if one.coordinates == EVERY else listed(map(plain, one.coordinates)),
                "behind": "not told" if one.behind is None else f"{one.behind:.1f}",
            }
            for one in verdict.in_set
        ],
        "rivals": [
            {
                "effect": called(effect),
                "rival": general(rival.name),
                "margin": rival.log_evidence_margin,
            }
            for effect in verdict.effects
            for rival in effect.rivals
        ],
        "not_testable": [
            {
                "effect": general(one.name),
                "why": readable(one.why),
                "test_that_would_tell": readable(one.test_that_would_tell) or "none of those tried",
            }
            for one in verdict.not_testable
        ],
        "detectable": [
            {
                "effect": general(one.name),
                "gap": one.gap,
                "by_name": "never" if one.by_name is None else f"{one.by_name:.2f}",
            }
            for one in sorted(verdict.smallest_detectable, key=lambda one: one.gap)
        ],
    }


def _place(effect: Missing, own: str) -> str:
    """Where a value holds: where the effect is, and the places of its own or how values differ."""
    return "; ".join(part for part in (where_of(effect), own or differing(effect)) if part)


def file_tables(results: ResultTables) -> Iterator[Parts]:
    """File, title, what is said of it, rows and columns of each table."""
    advised = shown_advice(results.table("next_tests"))
    if len(advised):
        yield "next_tests", "Which test next", _NEXT, advised, NEXT_TESTS.columns
    held_out, where = results.table("held_out"), results.table("where")
    proof = tuple(column for column in HELD_OUT.columns if column.name in _PROOF)
    yield "held_out", "Held-out proof", HELD_OUT.about, _worded(held_out), proof
    if len(where):
        yield "where", "Where the models are off", _WHERE, _worded(_above(where)), WHERE.columns
    candidates = results.table("candidates")
    if len(candidates):
        columns = tuple(column for column in CANDIDATES.columns if column.name in _TRIED)
        rows = _worded(_in_field_units(_best(candidates)))
        yield "candidates", "What was tried", _CANDIDATES, rows, columns


def _in_field_units(candidates: pd.DataFrame) -> pd.DataFrame:
    """Estimates as the field gives them, with what they are where it is not the parameter."""
    told = [
        estimate(row["effect"], json.loads(row["variant"]), row["estimate"], row["unit"])
        for row in candidates.to_dict("records")
    ]
    values, units = zip(*told, strict=True) if told else ((), ())
    return candidates.assign(estimate=list(values), unit=list(units))


def _worded(frame: pd.DataFrame) -> pd.DataFrame:
    """Effects, places and options in plain words."""
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
    """``flexion-extension, tangent`` of options as JSON."""
    values = [
        name
        for value in json.loads(text).values()
        for name in (value if isinstance(value, list) else [value])
    ]
    return ", ".join(motion_of(str(name)) for name in values)


def _above(where: pd.DataFrame) -> pd.DataFrame:
    """Without load steps, and without single places where noise may be all."""
    kept = (where["by"] != "step") & ((where["by"] != _ONE_PLACE) | (where["gap_low"] > 0.0))
    return where[kept].sort_values("gap", ascending=False, kind="stable")


def _best(candidates: pd.DataFrame) -> pd.DataFrame:
    """Stages in their order, in each the best first; of the screens one form of each effect."""
    rows = candidates[candidates["log_evidence"].notna()]
    order = {stage: number for number, stage in enumerate(rows["stage"].unique())}
    ordered = rows.assign(order=rows["stage"].map(order)).sort_values(
        ["order", "log_evidence"], ascending=[True, False], kind="stable"
    )
    again = ordered.duplicated(["stage", "effect"]) & ordered["stage"].str.startswith("screen")
    return ordered[~again]


def left_out(study: Discrepancy) -> Iterator[str]:
    """Parts that the settings leave out, each with the setting that does."""
    parts = (
        (
            "prediction of left-out specimens",
            "held_out: specimens: false",
            study.held_out.specimens,
        ),
        ("prediction of left-out tests", "held_out: tests: false", study.held_out.tests),
    )
    yield from (f"{part} ({setting})" for part, setting, done in parts if not done)
    if study.effects is not None:
        yield f"all effects but {', '.join(study.effects)} (effects)"
    for name, size in study.nuisance:
        if not size:
            yield f"nuisance {name} (nuisance: {name}: 0)"
