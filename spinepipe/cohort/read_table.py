"""A CSV file as a typed table, every bad cell located."""

import re
from collections.abc import Iterator
from math import isfinite, nan
from pathlib import Path

import pandas as pd

from spinepipe.cohort.columns import Column, TableForm
from spinepipe.cohort.read_rows import Rows, read_rows
from spinepipe.problems import Problem, did_you_mean, one_of

__all__ = ["read_table"]

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def read_table(path: Path, form: TableForm, file: str) -> tuple[pd.DataFrame | None, list[Problem]]:
    """Read and convert one CSV file.

    Parameters
    ----------
    path : the file, which exists.
    form : its declared columns.
    file : its name in messages.

    Returns
    -------
    The table, indexed by line number, with all declared columns (numbers as float64, NaN where
    empty or bad; text as str, NaN where an optional cell is empty) and then the carried ones;
    None when the file is no table or lacks a required column. And the problems.
    """
    rows, problems = read_rows(path, file)
    if rows is None:
        return None, problems
    problems += _column_problems(rows, form)
    lacking = any(column.required and column.name not in rows.header for column in form.columns)
    if lacking or not rows.cells:
        return None, problems
    texts = dict(zip(rows.header, map(list, zip(*rows.cells, strict=True)), strict=True))
    data: dict[str, pd.Series] = {}
    for column in form.columns:
        cells = texts.pop(column.name, [""] * len(rows.lines))
        data[column.name] = _converted(cells, column, rows, problems)
    if form.carries:
        data |= {name: _text_series(cells, rows.lines) for name, cells in texts.items()}
    return pd.DataFrame(data), problems


def _column_problems(rows: Rows, form: TableForm) -> Iterator[Problem]:
    for name in rows.header:
        if name not in form.names and not form.carries:
            remedy = did_you_mean(name, form.names, "delete the column or correct its name")
            yield Problem(rows.file, 1, name, "an unknown column", one_of(form.names), remedy)
    for column in form.columns:
        if column.required and column.name not in rows.header:
            yield Problem(
                rows.file, 1, column.name, "no such column", column.meaning, "add the column"
            )


def _converted(
    cells: list[str], column: Column, rows: Rows, problems: list[Problem]
) -> "pd.Series":
    if column.required:
        problems += [
            Problem(rows.file, line, column.name, "an empty cell", column.meaning, "fill it")
            for line, cell in zip(rows.lines, cells, strict=True)
            if not cell and line not in rows.ragged
        ]
    if column.kind == "text":
        return _text_series(cells, rows.lines)
    numbers = [float(cell) if NUMBER.fullmatch(cell) else nan for cell in cells]
    for index, (number, cell) in enumerate(zip(numbers, cells, strict=True)):
        if cell and (fault := _number_fault(cell, number, column)):
            allowed, remedy = fault
            place = (rows.file, rows.lines[index], column.name)
            problems.append(Problem(*place, f"'{cell}'", allowed, remedy))
            numbers[index] = nan
    return pd.Series(numbers, index=rows.lines, dtype="float64")


def _text_series(cells: list[str], lines: list[int]) -> "pd.Series":
    return pd.Series([cell or None for cell in cells], index=lines, dtype="str")


def _number_fault(cell: str, number: float, column: Column) -> tuple[str, str] | None:
    """What is allowed and what to do, when a number is wrong."""
    if not isfinite(number):
        remedy = "correct it" if column.required else "leave the cell empty if not measured"
        remedy = "write a decimal point" if "," in cell else remedy
        return "a finite number with a decimal point", remedy
    if column.kind == "integer" and number != int(number):
        return "a whole number", "correct it"
    low_bad = number <= column.low if column.open_low else number < column.low
    high_bad = number >= column.high if column.open_high else number > column.high
    if low_bad or high_bad:
        return f"{column.meaning}: {column.range_text}", "correct it; check its unit and its sign"
    return None
