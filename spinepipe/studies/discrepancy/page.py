"""The page of a search for missing effects."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, sortable
from spinepipe.report.words import listed, plain
from spinepipe.schema import Column, Table
from spinepipe.studies.discrepancy.conclusions import conclusions
from spinepipe.studies.discrepancy.quantities import quantities
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import (
    CANDIDATES,
    FIELD_NUMBERS,
    GAP,
    HELD_OUT,
    IMPERFECTIONS,
    MODELS,
    NEXT_TESTS,
    TABULATED,
    WHERE,
)
from spinepipe.studies.discrepancy.verdict import EVERY, Verdict, read_verdict, share_of_gap
from spinepipe.studies.discrepancy.words import SET_UP, general, motion_of, readable, what_of

FOLDER = "discrepancy/"
"""Where the result files are, from the page."""

SHAPES = (
    *(GAP, WHERE, CANDIDATES, HELD_OUT, IMPERFECTIONS),
    *(NEXT_TESTS, FIELD_NUMBERS, TABULATED),
)
READ = tuple(shape.name for shape in SHAPES)
"""Tables whose rows the page needs; of the others it tells where they come from."""

MISFIT = "Misfit is the root of chi squared over degrees of freedom less one; 0 is noise alone."

_SHOWN: Mapping[str, tuple[str, str, str]] = {
    "where": (
        "Misfit by place",
        MISFIT,
        "by specimen test joint coordinate readings model gap gap_low gap_high",
    ),
    "field_numbers": (
        "Numbers of the curves",
        "Read off the models: stiffness at rest and under load, motion, zone; means of specimens.",
        "model joint coordinate number load value unit low high",
    ),
    "held_out": (
        "Readings left out of the fit",
        HELD_OUT.about,
        "fold kind readings gap_base gap_base_low gap_base_high gap_with_effects "
        "gap_with_effects_low gap_with_effects_high worse message",
    ),
    "next_tests": (
        "What to measure next",
        "Runs that could be added, the one that tells most per cycle first.",
        "effect_or_pair test cycles gain_in_log_evidence status message",
    ),
    "candidates": (
        "Effects tried",
        "Each alone beside the base, in its best form: fitted (refit), or linear (screen).",
        "stage effect spread log_evidence gap_share decision",
    ),
    "imperfections": (
        "Set-up errors",
        "Most likely sizes beside the model with effects, in SDs of their tolerance; the largest.",
        "specimen kind component joint test value unit prior_sd in_prior_sds posterior_sd",
    ),
    "tabulated": (
        "Empirical curve",
        "Load that holds a joint at a motion, springs and effects included; it has no mechanism.",
        "joint coordinate over motion motion_unit load low high base load_unit",
    ),
    "gap": (
        "All readings, measured and modelled",
        GAP.about,
        "specimen test step joint coordinate load measured base with_effects noise_sd unit",
    ),
}
"""Of each table its title, what is said of it, and the columns that a reader compares."""

_WORDS: Mapping[str, Callable[[Any], object]] = {
    **dict.fromkeys(("test", "fold", "model", "number", "stage", "status"), plain),
    **dict.fromkeys(("effect_or_pair", "message", "joint"), readable),
    **dict.fromkeys(("coordinate", "over"), motion_of),
    "effect": general,
    "kind": lambda name: SET_UP.get(name, plain(name)),
    "component": lambda name: plain(name.removeprefix("tilt_")),
    "gap_share": share_of_gap,
}
"""How cells are told, by column."""


def page(study: Discrepancy, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    verdict = read_verdict(results.tables.files["verdict"])
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="load_displacement",
        tables=[*_of_verdict(verdict), *_of_files(results)],
        left_out=tuple(left_out(study)),
    )


def _of_verdict(verdict: Verdict) -> Iterator[Sortable]:
    """What the verdict alone holds; tables without rows are left out."""
    rivals = [
        (general(one.name), _motions(one.coordinates), one.log_evidence_margin)
        for effect in verdict.effects
        for one in effect.rivals
    ]
    tied = [(general(one.name), _motions(one.coordinates), one.behind) for one in verdict.in_set]
    sizes = [
        (what_of(effect), one.name, one.place, value.number, value.low, value.high, value.unit)
        for effect in verdict.effects
        for one in quantities(effect)
        if (value := one.value) is not None and not one.at_bound
    ]
    yield from _table(
        "Size of the effects",
        "Values of what was named, with all that the readings allow. Where an end is empty it is "
        "open, and the value is not identifiable.",
        "effect value_of place value* low* high* unit",
        sizes,
    )
    yield from _table(
        "Alternative explanations",
        "Effects that these tests cannot distinguish from the likeliest, and those next to what "
        "is named.",
        "effect acts_in log_units_behind*",
        [*tied, *rivals],
    )
    yield from _table(
        "What these tests cannot show",
        "Effects without a trace in these readings, and what would show them.",
        "effect why what_would_show_it",
        [
            (general(one.name), readable(one.why), readable(one.test_that_would_tell))
            for one in verdict.not_testable
        ],
    )
    yield from _table(
        "What would have been found",
        "Smallest misfit, in noise SD, that an effect must make to be found in nine data sets of "
        "ten, if only as one of several, and to be distinguished from every other.",
        "effect found_from* by_name_from*",
        [(general(one.name), one.gap, one.by_name) for one in verdict.smallest_detectable],
    )


def _table(title: str, about: str, names: str, rows: Sequence[object]) -> Iterator[Sortable]:
    """A table of the verdict; columns of numbers are marked by a star."""
    columns = [
        Column(name.rstrip("*"), "number" if name.endswith("*") else "text", plain(name))
        for name in names.split()
    ]
    if rows:
        frame = pd.DataFrame(rows, columns=[column.name for column in columns])
        name = title.lower().replace(" ", "-")
        yield sortable(name, title, about, frame, columns, f"{FOLDER}verdict.json")


def _motions(coordinates: Sequence[str]) -> str:
    return "" if tuple(coordinates) == EVERY else listed(map(motion_of, coordinates))


def _of_files(results: ResultTables) -> Iterator[Sortable]:
    """Rows of the result files that a reader compares, in plain words."""
    shapes: Mapping[str, Table] = {shape.name: shape for shape in SHAPES}
    for name, (title, about, shown) in _SHOWN.items():
        rows = _chosen(name, results.table(name))
        if rows.empty:
            continue
        words = {at: told for at, told in _WORDS.items() if at in rows}
        cells = {at: rows[at].map(told, na_action="ignore") for at, told in words.items()}
        columns = [shapes[name].column(column) for column in shown.split()]
        names = {one.name: one.name.replace("gap", "misfit") for one in columns}
        rows = rows.assign(**cells).rename(columns=names)
        columns = [replace(one, name=names[one.name]) for one in columns]
        yield sortable(name, title, about, rows, columns, f"{FOLDER}{name}.parquet")


def _chosen(name: str, rows: pd.DataFrame) -> pd.DataFrame:
    if rows.empty:
        return rows
    if name == "where":
        return rows[rows["by"] != "step"]
    if name == "field_numbers":
        return rows[rows["specimen"] == EVERY[0]]
    if name == "tabulated":
        return rows[(rows["specimen"] == EVERY[0]) & (rows["motion"] != 0.0)]
    if name == "imperfections":
        own = rows[(rows["model"] == MODELS[1]) & (rows["places"] == 1)]
        return own.loc[own["in_prior_sds"].abs().sort_values(ascending=False).index].head(20)
    if name == "candidates":
        first = rows[rows["log_evidence"].notna() & rows["stage"].isin(("refit 1", "screen 1"))]
        best = first.sort_values(["stage", "log_evidence"], ascending=[True, False], kind="stable")
        return best.drop_duplicates(["stage", "effect"])
    return rows


def left_out(study: Discrepancy) -> Iterator[str]:
    """Parts that the settings leave out, each with the setting that does."""
    if study.effects is not None:
        yield f"all effects but {', '.join(study.effects)} (effects)"
    # an error of the set-up that is given as an SD of 0 is not allowed for
    for name, size in study.nuisance:
        if not size:
            kind = name.removesuffix("_mm").removesuffix("_deg")
            yield f"errors of the set-up: {SET_UP[kind]} (nuisance: {name}: 0)"
