"""What all kinds of studies ask of a study file and its cohort: places, names, readings."""

from collections.abc import Iterable, Iterator, Sequence

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.supports import motion_read
from spinepipe.documents.form import TableForm
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem, Spelling
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, has_reading


def lacking_tables(
    document: YamlDocument, forms: Iterable[TableForm], cohort: Cohort
) -> Iterator[InputProblem]:
    """Tables that a study needs and its cohort does not have."""
    for form in forms:
        if form.stem not in cohort.further:
            found, allowed = f"a cohort without {form.file}", f"a cohort with {form.file}"
            remedy = f"add {form.file}, or name another cohort"
            yield InputProblem(*document.place_of("cohort"), found, allowed, remedy)


def unknown_tests(
    document: YamlDocument, tests: Sequence[str] | None, known: Sequence[str]
) -> Iterator[InputProblem]:
    """Tests that a study names and its cohort does not have."""
    spelling = Spelling(known, "delete it or add its loads")
    for index, name in enumerate(tests or ()):
        if name not in known:
            place = document.place_of(f"tests.{index}")
            found, remedy = f"unknown test '{name}'", spelling.remedy(name)
            yield InputProblem(*place, found, spelling.allowed, remedy)


def unknown_names(
    document: YamlDocument, key: str, what: str, names: Sequence[str] | None, known: Sequence[str]
) -> Iterator[InputProblem]:
    """Names in the list of a key that its cohort does not have.

    Parameters
    ----------
    what : kind of the names, in words.
    """
    spelling = Spelling(known, "delete it or correct its name")
    for index, name in enumerate(names or ()):
        if name not in known:
            place = document.place_of(f"{key}.{index}")
            found, remedy = f"unknown {what} '{name}'", spelling.remedy(name)
            yield InputProblem(*place, found, spelling.allowed, remedy)


def unknown_levels(
    document: YamlDocument, levels: Iterable[str], joints: Sequence[str]
) -> Iterator[InputProblem]:
    """Joints that ``level_stiffness`` has values for and the cohort does not have."""
    spelling = Spelling(joints, "delete it or correct its name")
    for name in levels:
        if name not in joints:
            place = document.place_of(f"level_stiffness.{name}")
            found, remedy = f"unknown joint '{name}'", spelling.remedy(name)
            yield InputProblem(*place, found, spelling.allowed, remedy)


_PLACE = ["specimen", "test", "step", "joint"]


def readings(
    cohort: Cohort, tests: Sequence[str] | None, coordinates: Sequence[str] | None
) -> pd.DataFrame:
    """Rows of motion with a reading, and their columns of the coordinates; None stands for all.

    Zeros that zeroing made are no readings, nor are coordinates that a rig fixes.

    Parameters
    ----------
    cohort : with motion.
    """
    columns = [
        column
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if name in (coordinates or COORDINATES)
    ]
    motion = motion_read(cohort)
    there = has_reading(motion["step"], cohort.zeroed_at_step_0)
    read = motion[columns].notna().any(axis=1) & there
    chosen = motion["test"].isin(list(tests or cohort.tests))
    return motion.loc[read & chosen, [*_PLACE, "cycle", *columns]]


def measured_columns(rows: pd.DataFrame) -> list[str]:
    """Columns of coordinates that have a reading, in their order."""
    return [c for c in COORDINATE_COLUMNS if c in rows and bool(rows[c].notna().any())]


def repeated(rows: pd.DataFrame, columns: Sequence[str]) -> bool:
    """Whether any coordinate was read at the same place in two cycles of a test."""
    counts = rows.groupby(_PLACE)[list(columns)].count()
    return bool((counts > 1).to_numpy().any())
