"""Tidy tables of a computed study, by the rows of `mapping.csv`, which say all that is of a kind.

A row names a tidy table, the table of the study that it is read from, which rows of it
(``where``: ``column=value|value`` or ``column!=...``, held apart by semicolons), and its columns:
names of the table's own, patterns of them, ``new=name``, or ``new=name-name`` for a difference. The
status comes first. A column whose unit hangs on the row becomes one column per unit.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import pandas as pd

from spinepipe.documents.names import EVERYONE
from spinepipe.files import appearing
from spinepipe.report.conclusions import Told, read_back
from spinepipe.schema import Column, Table
from spinepipe.schema.datapackage import FILE, descriptor
from spinepipe.studies.registry import kind_of
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import COORDINATE_UNITS, LOAD_UNITS

FOLDER = "tidy"

ALL = "all"
"""Instead of ``*`` for what all joints share, which other programs take for a pattern."""

QUALITY = Table(
    "quality",
    "What was looked at before results are trusted: one row per check.",
    ("check", "finding"),
    (
        Column(
            "light",
            "text",
            "ok; check: look at it; stop: do not use",
            allowed=("ok", "check", "stop"),
        ),
        Column("check", "text", "what was looked at"),
        Column("finding", "text", "what was found, and what to do about it"),
    ),
)

_SLUGS = {
    **{"mm": "mm", "deg": "deg", "s": "s", "N": "n", "N m": "nm", "MPa": "mpa", "%": "percent"},
    **{"N/m": "n_per_m", "N m/rad": "nm_per_rad", "N/mm": "n_per_mm", "N m/deg": "nm_per_deg"},
    **{"noise SD": "noise_sd", "": ""},
}
"""Ends of names of columns, by unit. Any other unit is words: it hangs on the row."""

_ELEMENTARY = ("mu", "mu_star", "sigma")
"""Indices that have the unit of their output; the others have none."""


def tidied(kind: str, frames: Mapping[str, pd.DataFrame]) -> dict[str, tuple[Table, pd.DataFrame]]:
    """Tidy tables by name, of those whose table is there.

    Parameters
    ----------
    frames : tables of the study by name; `conclusions` for the table of quality.
    """
    made: dict[str, tuple[Table, pd.DataFrame]] = {}
    for row in _mapping():
        if row["kind"] == kind and row["table"] in frames:
            shape, rows = kind_of(kind).table(row["table"]), frames[row["table"]]
            chosen = rows[_chosen(rows, row["where"])].reset_index(drop=True)
            if len(chosen):
                made[row["tidy"]] = _made(row["tidy"], row["columns"].split(), shape, chosen)
    if CONCLUSIONS.name in frames:
        made[QUALITY.name] = QUALITY, quality(read_back(frames[CONCLUSIONS.name]))
    return made


def quality(conclusions: Iterable[Told]) -> pd.DataFrame:
    """Lights of a page as `QUALITY`, the worst first."""
    lights = [one for one in conclusions if one.place == "light"]
    rows = [(one.level, *one.whole.split(": ", 1)) for one in lights]
    ranked = sorted(rows, key=lambda one: -QUALITY.columns[0].allowed.index(one[0]))
    return pd.DataFrame(ranked, columns=QUALITY.names)


def write_tidy(results: Path, kind: str) -> list[Path]:
    """Write ``tidy/`` in the folder of a study's results: CSV, Parquet, ``datapackage.json``.

    Returns
    -------
    list of Path
        Of the CSV files.

    Raises
    ------
    DamagedFile
        As `spinepipe.tables.read` does.
    """
    wanted = {row["table"] for row in _mapping() if row["kind"] == kind} | {CONCLUSIONS.name}
    # conclusions lie beside the page, tables of some kinds in a folder below
    places = {results, results / kind_of(kind).files.subfolder}
    paths = [at / f"{name}.parquet" for at in places for name in sorted(wanted)]
    found = {path.stem: read_frame(path) for path in paths if path.is_file()}
    made = tidied(kind, found)
    for name, (table, rows) in made.items():
        path = results / FOLDER / f"{name}.csv"
        columns: dict[str, Any] = {head: rows[head] for head in table.names}
        write(to_arrow(table, columns), path.with_suffix(".parquet"), {"kind": kind})
        with appearing(path) as temporary:
            rows.to_csv(temporary, index=False)
    told = [(table, f"{name}.csv") for name, (table, _) in made.items()]
    with appearing(results / FOLDER / FILE) as temporary:
        temporary.write_text(descriptor(results.name, f"Tidy results of {results.name}", told))
    return [results / FOLDER / name for _, name in told]


def _made(
    name: str, wanted: list[str], shape: Table, rows: pd.DataFrame
) -> tuple[Table, pd.DataFrame]:
    """A tidy table and its rows, the status first."""
    status = ["status"] if "status" in shape.names else []
    names: dict[str, str] = {}
    columns: dict[str, Any] = {}
    told = []
    for new, column, values in _columns([*status, *wanted], shape, rows):
        if values.dtype == object or column.type == "text":
            values = values.where(values != EVERYONE, ALL)
        names[column.name] = new
        for one, cells in _by_unit(replace(column, name=new), values, rows):
            told.append(one)
            columns[one.name] = cells
    key = tuple(names[one] for one in shape.key if one in names)
    return Table(name, shape.about, key, tuple(told)), pd.DataFrame(columns)


def _columns(
    wanted: list[str], shape: Table, rows: pd.DataFrame
) -> Iterator[tuple[str, Column, "pd.Series[Any]"]]:
    """New name, declaration and cells of each column that is asked for."""
    for one in wanted:
        new, _, old = one.rpartition("=")
        first, _, second = old.partition("-")
        for name in (n for n in shape.names if fnmatchcase(n, first)):
            column, values = shape.column(name), rows[name]
            if second:
                column = replace(
                    column,
                    name="",
                    meaning=f"{first} less {second}",
                    low=-float("inf"),
                    nullable=True,
                    empty="one of both is missing",
                )
                values = values - rows[second]
            yield new or name, column, values


def _by_unit(
    column: Column, values: "pd.Series[Any]", rows: pd.DataFrame
) -> Iterator[tuple[Column, "pd.Series[Any]"]]:
    """A column whose name ends with its unit, or one per unit where rows differ in it."""
    if column.type != "number" or column.unit in _SLUGS:
        yield _with_unit(column, column.unit), values
        return
    units = _units(column, rows)
    for unit in sorted(set(units)):
        one = _with_unit(column, unit)
        if units.nunique() > 1:
            one = replace(one, nullable=True, empty=f"{column.name} is in another unit")
        yield one, values.where(units == unit)


def _with_unit(column: Column, unit: str) -> Column:
    slug = _SLUGS[unit] if column.type == "number" else ""
    ends = not slug or column.name == slug or column.name.endswith(f"_{slug}")
    return replace(column, name=column.name if ends else f"{column.name}_{slug}", unit=unit)


def _units(column: Column, rows: pd.DataFrame) -> "pd.Series[Any]":
    """The unit of each cell of a column that has several."""
    if "unit" in rows:
        if " where " not in column.unit:
            return rows["unit"]
        return rows["unit"].map({"deg": "N m", "N m": "N m", "mm": "N", "N": "N"})
    if "measure" in rows:
        return rows["measure"].str.rpartition("_")[2]
    if "output" not in rows:
        return rows["coordinate"].map(COORDINATE_UNITS)
    of_output = (
        rows["coordinate"]
        .map(COORDINATE_UNITS)
        .where(rows["output"] == "motion", rows["coordinate"].map(LOAD_UNITS))
    )
    return of_output.where(rows["index"].isin(_ELEMENTARY), "")


def _chosen(rows: pd.DataFrame, where: str) -> "pd.Series[bool]":
    chosen = pd.Series(True, index=rows.index)
    for one in filter(None, where.split("; ")):
        name, _, values = one.partition("=")
        is_in = rows[name.rstrip("!")].astype(str).isin(values.split("|"))
        chosen &= ~is_in if name.endswith("!") else is_in
    return chosen


@cache
def _mapping() -> list[dict[str, str]]:
    text = files(__package__).joinpath("mapping.csv").read_text("utf-8")
    return list(csv.DictReader(text.splitlines()))
