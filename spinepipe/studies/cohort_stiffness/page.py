"""The report of a cohort study: its tables, and what is said of parts that it leaves out."""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import Document, ResultTables
from spinepipe.report.page.tables import Sortable, beside_paper, sortable
from spinepipe.schema import Column, Table, all_declared
from spinepipe.studies.cohort_stiffness.page_findings import findings
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS
from spinepipe.studies.cohort_stiffness.settings import (
    ALL_BUT,
    GOULD_2024B,
    NOBODY,
    CohortStiffness,
    representations_of,
)
from spinepipe.studies.cohort_stiffness.stages import own_fits
from spinepipe.studies.cohort_stiffness.tables import (
    AGAINST_GOULD_2024B,
    FINDINGS,
    HELICAL_AXES,
    LOAD_DISPLACEMENT,
)

QUESTION = (
    "Does stiffness differ between specimens, levels and load cases, how should it be described, "
    "and does it carry over to what it was not fitted to?"
)

SHOWN = {
    "findings": "Claims about the cohort, checked",
    "ranking": "Representations in order",
    "mae": "Mean absolute errors in the loaded direction",
    "pooling": "How stiffness is spread over the cohort",
    "covariates": "What of the specimens stiffness goes with",
    "against_gould_2024b": "Beside Gould et al. 2024b",
    "sign_checks": "Does each joint move with the load?",
    "load_displacement": "Range of motion, neutral zone, stiffness and lost work of each curve",
    "helical_axes": "Helical axes and centres of rotation",
    "fits": "Fits",
    "stiffness": "Stiffness fitted to all load cases",
    "nuisances": "Errors of joint centres and axes fitted beside",
    "statistics": "Tests of significance",
}
"""Tables of the page in their order, with their titles."""

READ = SHOWN
"""Tables whose rows the page needs; of the others it tells where they come from."""

_CLAIM_ORDER = (
    *("statement", "holds", "value", "unit", "low", "high"),
    *("p", "p_holm", "quantity", "message"),
)

_NOT_SHOWN = ("representation", "readings", "least_load_nm", "largest_load_nm", "from_nm", "to_nm")
"""Columns of curves and axes that are left to the files, beside ends of zones and SDs of axes."""


def _shown(table: Table) -> tuple[Column, ...]:
    """Columns of a table of an experiment that fit on a page."""
    inner = ("neutral_zone_from", "neutral_zone_to", "neutral_zone_stiffness_", "direction_")
    return tuple(
        column
        for column in table.columns
        if column.name not in _NOT_SHOWN
        and not (column.name.startswith(inner) and column.name.endswith(("_sd", "rad", "_nm")))
    )


_COLUMNS = {
    FINDINGS.name: tuple(map(FINDINGS.column, _CLAIM_ORDER)),
    **{table.name: _shown(table) for table in (LOAD_DISPLACEMENT, HELICAL_AXES)},
}
"""What a reader compares stands first; short names are left to the files."""

_SHAPES = {table.name: table for table in all_declared(__file__)}

NO_LEVELS = (
    "no stiffness of single levels is published for these joints and the coordinates that are free"
)

HELD_OUT_ERROR = "held_out_error"
"""The figure of errors of held-out motion."""

NOT_HELD_OUT = (
    "Besides the bushings, effects of the model file {file} act in all models. Their values are "
    "the file's in every bar: those for all specimens where it has such, else those for the "
    "specimen itself. Readings that they were found on count as held out here for stiffness only."
)


def document(study: CohortStiffness, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    pictures = list(results.pictures.values())
    if study.base is not None:  # beneath held-out errors, what of its model was not held out
        note = NOT_HELD_OUT.format(file=study.base.model)
        pictures = [
            replace(one, caption=f"{one.caption} {note}") if one.name == HELD_OUT_ERROR else one
            for one in pictures
        ]
    return Document(
        question=QUESTION,
        findings=findings(study, results),
        pictures=pictures,
        tables=shown_tables(results),
        metadata=results.metadata,
        left_out=(
            *left_out(study, len(cohort.specimen_names), cohort.joint_names),
            *papers.left_out(GOULD_2024B.cited, GOULD_2024B.stands_for(cohort.name)),
        ),
        poses=results.table("poses"),
    )


def left_out(study: CohortStiffness, specimens: int, joints: Sequence[str] = ()) -> tuple[str, ...]:
    """Parts that the settings or the cohort leave out, each with the reason."""
    held = study.cross_validation
    kept = representations_of(study, joints)
    lost = [IN_WORDS[name] for name in study.representations if name not in kept]
    parts = (
        ("prediction of left-out specimens", "cross_validation: specimens: false", held.specimens),
        (
            "prediction of left-out specimens",
            "the cohort has one specimen",
            not held.specimens or specimens > 1,
        ),
        (
            "prediction of left-out load cases",
            "cross_validation: load_cases: false",
            held.load_cases,
        ),
        (" and ".join(lost), NO_LEVELS, not lost),
    )
    return tuple(f"{part} ({why})" for part, why, done in parts if not done)


def shown_tables(results: ResultTables) -> list[Sortable]:
    """Tables that the study has, as the page shows them; those without rows are left out."""
    found = []
    for name, title in SHOWN.items():
        frame = results.table(name)
        if not len(frame):
            continue
        rows, told = _rows(name, frame)
        shape = _SHAPES[name]
        if shape is AGAINST_GOULD_2024B:
            found += beside_paper(shape, title, rows)
            continue
        columns = _COLUMNS.get(shape.name, shape.columns)
        found.append(sortable(name, title, f"{shape.about} {told}".strip(), rows, columns))
    return [table for table in found if table.rows]


def _rows(name: str, frame: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Rows that the page shows, and what is said of those that it does not."""
    chosen, told = frame, ""
    if name == "stiffness":
        chosen, told = own_fits(frame), "own fits to all load cases"
    elif name == "pooling":
        chosen, told = frame[frame["without"] == NOBODY], "fits of all specimens"
    elif name in ("fits", "mae", "nuisances"):
        left_out = frame["fitted_to"].astype(str).str.startswith(ALL_BUT)
        chosen, told = frame[~left_out], "fits that leave no load case out"
    if len(chosen) == len(frame):
        return frame, ""
    return chosen, f"Here: {told}; the others are in {name}.parquet."
