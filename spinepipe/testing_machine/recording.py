"""Read one file of a testing machine: the columns that the YAML names, in the cohort's units.

Every fault of the file is told at once. A fault that a column has in many lines is told at the
first of them, with how many more there are: a machine writes thousands of lines.
"""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import medfilt

from spinepipe.documents.text import MOST_CSV_BYTES, NUMBER, read_bytes
from spinepipe.problems import InputProblem, did_you_mean, one_of
from spinepipe.report.words import count
from spinepipe.testing_machine.channels import (
    DIRECTIONS,
    SECONDS,
    column_of,
    factor_of,
)
from spinepipe.testing_machine.instruments import SYNC
from spinepipe.testing_machine.settings import FileForm, MachineMapping, TestFile

__all__ = ["Recording", "read_recording"]

Array = NDArray[np.float64]

MARKS = {"comma": ",", "semicolon": ";", "tab": "\t"}
WINDOW = 5
JUMP = 0.1
"""Share of the range of a column by which a row must jump away to be left out."""

FEWEST_LINES = 10
"""Of a test with a way up and a way down; below that nothing can be told from noise."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What a machine wrote of one test, in the units and signs of the cohort's columns.

    Attributes
    ----------
    file : its name in messages. of : what the YAML says of it.
    lines : (N,) line of each row, as an editor shows it.
    time : (N,) s from the first row, None where no column is mapped.
    loads : (N,) by column of ``loads.csv``. driving : which of them goes up and down.
    motion : (N,) by joint and column of ``motion.csv``.
    finest : smallest step between two readings of each motion, 0 where all are equal.
    spikes : rows left out, in which a reading jumps away from those before and behind.
    notes : what else is to be said of it.
    """

    file: str
    of: TestFile
    lines: NDArray[np.int64]
    time: Array | None
    loads: dict[str, Array]
    driving: str
    motion: dict[tuple[str, str], Array]
    finest: dict[tuple[str, str], float]
    spikes: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Cells:
    """Rows of text: ``names`` of the columns, empty without; ``lines`` of the rows."""

    names: list[str]
    lines: list[int]
    rows: list[list[str]]
    width: int


def read_recording(
    path: Path, of: TestFile, mapping: MachineMapping
) -> tuple[Recording | None, list[InputProblem]]:
    """Read one file; None, and every problem, where it cannot be used."""
    file = of.file
    if not path.is_file():
        allowed = "a file, told relative to the YAML"
        return None, [InputProblem(file, None, None, "no such file", allowed, "correct the path")]
    data, problems = read_bytes(path, file, MOST_CSV_BYTES)
    if problems:
        return None, problems
    try:
        encoding = mapping.form.encoding
        text = data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeError:
        remedy = "set `form: {encoding: latin-1}` or utf-16, or save the file as UTF-8"
        found = f"letters that are not {mapping.form.encoding}"
        return None, [InputProblem(file, None, None, found, "the encoding of the YAML", remedy)]
    try:
        cells, problems = _cells(text, file, mapping.form)
    except csv.Error as error:
        found, allowed = f"no table ({error})", f"cells separated by a {mapping.form.delimiter}"
        return None, [InputProblem(file, None, None, found, allowed, "look at `form.delimiter`")]
    if cells is None:
        return None, problems
    return _understood(cells, of, mapping, problems)


def _cells(text: str, file: str, form: FileForm) -> tuple[_Cells | None, list[InputProblem]]:
    """Rows below the names; blank lines are skipped, empty cells at the end of a row too."""
    first = form.first_line or form.names_line + 1
    names: list[str] = []
    lines, rows = [], []
    for line, row in _rows(text, form):
        while row and not row[-1]:
            row.pop()
        if line == form.names_line:
            names = row
        elif line >= first and row:
            lines.append(line)
            rows.append(row)
    if form.names_line and not names:
        allowed = f"names of columns in line {form.names_line}"
        problem = InputProblem(
            file, None, None, "no such line, or an empty one", allowed, "correct it"
        )
        return None, [problem]
    if len(rows) < FEWEST_LINES:
        found, allowed = f"{len(rows)} lines of numbers", f"at least {FEWEST_LINES}"
        remedy = "look whether `form.first_line` is right"
        return None, [InputProblem(file, first, None, found, allowed, remedy)]
    return _Cells(names, lines, rows, max(map(len, rows))), []


def _rows(text: str, form: FileForm) -> Iterator[tuple[int, list[str]]]:
    if form.delimiter == "space":
        yield from ((n, row.split()) for n, row in enumerate(text.splitlines(), start=1))
        return
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=MARKS[form.delimiter])
    line = 1
    for row in reader:
        yield line, [cell.strip() for cell in row]
        line = reader.line_num + 1


def _understood(
    cells: _Cells, of: TestFile, mapping: MachineMapping, problems: list[InputProblem]
) -> tuple[Recording | None, list[InputProblem]]:
    time = None
    if mapping.time is not None:
        seconds = _column(cells, mapping.time.column, of.file, mapping.form, problems)
        if seconds is not None:
            time = (seconds - seconds[0]) * SECONDS[mapping.time.unit]
            problems += _backwards(time, cells, of.file, str(mapping.time.column))
    loads: dict[str, Array] = {}
    for load in mapping.loads:
        values = _column(cells, load.column, of.file, mapping.form, problems)
        if values is not None:
            factor = factor_of(load.unit, load.positive)
            loads[DIRECTIONS[load.positive].load] = values * factor
    motion: dict[tuple[str, str], Array] = {}
    finest: dict[tuple[str, str], float] = {}
    gaps = mapping.form.empty_cells == "left_out"
    for channel in mapping.motion:
        values = _column(cells, channel.column, of.file, mapping.form, problems, gaps)
        if values is not None:
            factor = factor_of(channel.unit, channel.positive)
            place = (channel.joint, column_of(DIRECTIONS[channel.positive].coordinate))
            motion[place] = values * factor
            there = motion[place][np.isfinite(values)]
            steps = np.diff(np.unique(there))  # between readings that differ
            finest[place] = float(steps.min()) if steps.size else 0.0
    if problems:
        return None, problems
    driving = DIRECTIONS[mapping.driving(of).positive].load if mapping.loads else ""
    whole = np.all([np.isfinite(one) for one in (*loads.values(), *motion.values())], axis=0)
    empty = int(np.count_nonzero(~whole))
    notes = (f"{count(empty, 'row')} with an empty cell left out",) if empty else ()
    sound = whole.copy()
    # a signal by which clocks are compared jumps and may
    read = [*loads.values(), *(one for (joint, _), one in motion.items() if joint != SYNC)]
    sound[whole] = ~np.any([_jumps(one[whole]) for one in read], axis=0)
    recording = Recording(
        file=of.file,
        of=of,
        lines=np.array(cells.lines)[sound],
        time=None if time is None else time[sound],
        loads={name: values[sound] for name, values in loads.items()},
        driving=driving,
        motion={place: values[sound] for place, values in motion.items()},
        finest=finest,
        spikes=int(np.count_nonzero(whole & ~sound)),
        notes=notes,
    )
    return recording, []


def _column(
    cells: _Cells,
    column: str | int,
    file: str,
    form: FileForm,
    problems: list[InputProblem],
    gaps: bool = False,
) -> Array | None:
    """(N,) numbers of a column as written; None, with the problems added, where some are none.

    ``gaps``: whether empty cells may stand in it, as NaN.
    """
    place = _place(cells, column)
    if place is None:
        known: Sequence[str] = cells.names or [str(n + 1) for n in range(cells.width)]
        otherwise = "correct the name; look whether `form.names_line` is right"
        if len(cells.names) == 1:
            otherwise = f"is `form.delimiter` right? With {form.delimiter} the file has one column"
        remedy = did_you_mean(str(column), known, otherwise)
        line = form.names_line or None
        problems.append(
            InputProblem(file, line, str(column), "no such column", one_of(known), remedy)
        )
        return None
    texts = [row[place] if place < len(row) else "" for row in cells.rows]
    if form.decimal == "comma":
        texts = [text.replace(",", ".") if "." not in text else "" for text in texts]
    values = np.array([float(t) if NUMBER.fullmatch(t) else np.nan for t in texts])
    bad = np.flatnonzero(~np.isfinite(values) & ~(gaps & (np.array(texts) == "")))
    if bad.size:
        problems.append(_no_numbers(cells, place, bad, file, str(column), form))
        return None
    return values


def _place(cells: _Cells, column: str | int) -> int | None:
    if isinstance(column, int):
        return column - 1 if column <= cells.width else None
    return cells.names.index(column) if column in cells.names else None


def _no_numbers(
    cells: _Cells, place: int, bad: NDArray[np.int64], file: str, column: str, form: FileForm
) -> InputProblem:
    row = cells.rows[int(bad[0])]
    found = f"'{row[place]}'" if place < len(row) and row[place] else "an empty cell"
    if bad.size > 1:
        found += f" and {bad.size - 1} more such lines"
    remedy = "correct the cells, or take the lines out"
    if form.decimal == "point" and place < len(row) and "," in row[place]:
        remedy = "set `form: {decimal: comma}` if the machine writes decimal commas"
    elif form.decimal == "comma" and place < len(row) and "." in row[place]:
        remedy = "set `form: {decimal: point}` if the machine writes decimal points"
    allowed = f"a finite number with a decimal {form.decimal} in every line"
    return InputProblem(file, cells.lines[int(bad[0])], column, found, allowed, remedy)


def _backwards(time: Array, cells: _Cells, file: str, column: str) -> Iterator[InputProblem]:
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        more = f", {back.size} times in all" if back.size > 1 else ""
        found = f"a time before that of the line above{more}"
        remedy = "look for recordings put one below the other, and give each its own file"
        yield InputProblem(
            file, cells.lines[int(back[0]) + 1], column, found, "times that go on", remedy
        )


def _jumps(values: Array) -> NDArray[np.bool_]:
    """(N,) whether a reading is far from the running median, far beyond what a row moves on."""
    usual = medfilt(values, WINDOW)
    edge = WINDOW // 2
    usual[:edge], usual[-edge:] = values[:edge], values[-edge:]  # the filter knows none beyond
    away = np.abs(values - usual)
    steps = float(np.quantile(np.abs(np.diff(usual)), 0.95))
    return away > max(JUMP * float(np.ptp(usual)), 3.0 * steps, 10.0 * float(np.median(away)))
