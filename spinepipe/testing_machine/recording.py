"""Read one file of a testing machine: the columns that the YAML names, in the cohort's units.

Every fault of the file is told at once. A fault that a column has in many lines is told at the
first of them, with how many more there are: a machine writes thousands of lines.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from unicodedata import normalize

import numpy as np
from numpy.typing import NDArray
from scipy.signal import medfilt

from spinepipe.documents.text import read_bytes
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.report.words import count
from spinepipe.testing_machine.channels import (
    DIRECTIONS,
    SECONDS,
    factor_of,
    mistyped,
)
from spinepipe.testing_machine.instruments import SYNC
from spinepipe.testing_machine.notation import (
    AS_TIME,
    LOST,
    Notation,
    clock_seconds,
    is_number,
    notations_of,
    past_midnight,
    remedy,
)
from spinepipe.testing_machine.raw_table import (
    LOOKED_AT,
    MOST_BYTES,
    RawTable,
    cell_at,
    open_table,
    text_rows,
)
from spinepipe.testing_machine.settings import (
    LoadChannel,
    MachineMapping,
    MotionChannel,
    TestFile,
    TimeChannel,
)

__all__ = ["Recording", "read_recording"]

Array = NDArray[np.float64]
Lines = NDArray[np.int64]
Channel = TimeChannel | LoadChannel | MotionChannel

STANDING = 0.1
"""Share of rows that read as the one before them, where an instrument counts in steps."""

WINDOW = 5
JUMP = 0.1
"""Share of the range of a column by which a row must jump away to be left out."""

SERIAL_DAYS, SHORT_DAYS = (30_000, 60_000), 0.5
"""Days since 1900 of 1982 to 2064, and longer than any test."""

NO_COLUMN = "no such column"
BELOW_UNITS = "set `form: {first_line:"

FEWEST_LINES = 10
"""Of a test with a way up and a way down; below that nothing can be told from noise."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What a machine wrote of one test, in the units and signs of the cohort's columns.

    Attributes
    ----------
    file : its name in messages. of : what the YAML says of it.
    lines : (N,) line of each row, as an editor shows it.
    rows : (N,) number of each among those of the file, from 0: blank lines are none, those left
        out are.
    time : (N,) s from the first row, None where no column is mapped.
    loads : (N,) by column of ``loads.csv``. driving : which of them goes up and down.
    motion : (N,) by joint and column of ``motion.csv``.
    finest : resolution of the readings of each motion, 0 where all are equal.
    spikes : rows left out, in which a reading jumps away from those before and behind.
    notes : what else is to be said of it.
    """

    file: str
    of: TestFile
    lines: Lines
    rows: Lines
    time: Array | None
    loads: dict[str, Array]
    driving: str
    motion: dict[tuple[str, str], Array]
    finest: dict[tuple[str, str], float]
    spikes: int
    notes: tuple[str, ...] = ()


def read_recording(path: Path, of: TestFile, mapping: MachineMapping) -> Recording:
    """Read one file.

    Raises
    ------
    InputError
        With every problem of the file.
    """
    file = of.file
    if not path.is_file():
        allowed = "a file, told relative to the YAML"
        lacks = InputProblem(file, None, None, "no such file", allowed, "correct the path")
        raise InputError([lacks])
    data, problems = read_bytes(path, file, MOST_BYTES)
    if problems:
        raise InputError(problems)
    mapping = mapping.of_file(of)
    try:
        return _understood(open_table(data, file, mapping.form), of, mapping)
    except csv.Error as error:
        found = f"no table ({error})"
        remedy = "look at `form.delimiter`; open the file and save it anew"
        raise InputError(
            [InputProblem(file, None, None, found, "rows of cells", remedy)]
        ) from error


def _understood(table: RawTable, of: TestFile, mapping: MachineMapping) -> Recording:
    channels: list[Channel] = [*mapping.loads, *mapping.motion]
    if mapping.time is not None:
        channels.insert(0, mapping.time)
    placed = [_place(table, of.file, one.column, channels) for one in channels]
    problems = [one for one in placed if isinstance(one, InputProblem)]
    there = [(a, b) for a, b in zip(channels, placed, strict=True) if isinstance(b, int)]
    for number, (channel, place) in enumerate(there):
        if any(place == other for _, other in there[:number]):
            found, allowed = f"column {place + 1}, which is told twice", "each column once"
            remedy = "correct its name or number"
            problems.append(
                InputProblem(of.file, None, str(channel.column), found, allowed, remedy)
            )
    if not there:
        raise InputError(problems)
    lines, rows, numbers, faults = _numbers(table, of.file, there)
    problems += [*_misfits(table, of.file, channels, faults), *faults]
    if len(lines) < FEWEST_LINES:
        raise InputError([*problems, _too_few(of.file, table.first, len(lines))])
    time = None
    if mapping.time is not None and mapping.time.column in numbers:
        time = numbers[mapping.time.column]
        if mapping.time.unit == "clock":
            time = past_midnight(time)
        elif SERIAL_DAYS[0] < time[0] < SERIAL_DAYS[1] and np.ptp(time) < SHORT_DAYS:
            at = (of.file, int(lines[0]), str(mapping.time.column))
            found = f"{time[0]:.10g}, and all within {np.ptp(time):.2g}: days since 1900"
            problems.append(InputProblem(*at, found, "seconds, ms or min", AS_TIME))
        time = (time - time[0]) * SECONDS[mapping.time.unit]
        problems = [*_backwards(time, lines, of.file, str(mapping.time.column)), *problems]
    if problems:
        raise InputError(problems)
    loads = {
        # 0.0: a reading turned round is not -0
        DIRECTIONS[one.positive].load: numbers[one.column] * factor_of(one.unit, one.positive) + 0.0
        for one in mapping.loads
    }
    motion = {
        (one.joint, DIRECTIONS[one.positive].motion): numbers[one.column]
        * factor_of(one.unit, one.positive)
        + 0.0
        for one in mapping.motion
    }
    every = [*loads.values(), *motion.values()]
    whole = np.all([np.isfinite(one) for one in every], axis=0)
    empty = int(np.count_nonzero(~whole))
    if len(lines) - empty < FEWEST_LINES:
        raise InputError([_too_few(of.file, table.first, len(lines) - empty)])
    sound = whole.copy()
    # a signal by which clocks are compared jumps and may
    read = [*loads.values(), *(one for (joint, _), one in motion.items() if joint != SYNC)]
    sound[whole] = ~np.any([_jumps(one[whole]) for one in read], axis=0)
    return Recording(
        file=of.file,
        of=of,
        lines=lines[sound],
        rows=rows[sound],
        time=None if time is None else time[sound],
        loads={name: values[sound] for name, values in sorted(loads.items())},
        driving=DIRECTIONS[mapping.driving(of).positive].load if mapping.loads else "",
        motion={place: values[sound] for place, values in sorted(motion.items())},
        finest={place: _resolution(one[whole]) for place, one in motion.items()},
        spikes=int(np.count_nonzero(whole & ~sound)),
        notes=(f"{count(empty, 'row')} with an empty cell left out",) if empty else (),
    )


def _too_few(file: str, line: int, rows: int) -> InputProblem:
    remedy = "look whether `form.first_line` is right"
    allowed = f"at least {FEWEST_LINES}"
    return InputProblem(file, line, None, count(rows, "line of numbers"), allowed, remedy)


def _misfits(
    table: RawTable, file: str, channels: Sequence[Channel], faults: Sequence[InputProblem]
) -> Iterator[InputProblem]:
    """The first row that has other cells than the names say: columns may be shifted."""
    misfit = table.misfit()
    if misfit is None or any(one.remedy.startswith(BELOW_UNITS) for one in faults):
        return
    line, cells = misfit
    remedy = "give each column one name, or tell columns by their number"
    if table.form.delimiter == "space":
        remedy = f"names may have no blanks: {remedy}"
    if table.form.delimiter == "comma" and all(re.fullmatch("[+-]?[0-9]*", c) for c in cells):
        remedy = (
            "are decimals set off by commas? Then let the machine put semicolons or tabs between "
            "cells, or quotes around them. Else set `form: {names_line: 0, first_line: "
            f"{table.first}}}` and tell columns by their number"
        )
    elif all(isinstance(one.column, int) for one in channels):
        return
    found = f"{count(len(table.names), 'name')}, {count(len(cells), 'cell')}"
    yield InputProblem(file, line, None, found, "a name for each cell", remedy)


def _place(
    table: RawTable, file: str, column: str | int, channels: Sequence[Channel]
) -> int | InputProblem:
    """Number from 0 of a column, or why there is none."""
    line, names = table.form.names_line or None, table.names
    if isinstance(column, int) and column <= table.width:
        return column - 1
    places = [number for number, name in enumerate(names, start=1) if name == column]
    if not places:
        looks = _look(str(column))
        places = [number for number, name in enumerate(names, start=1) if _look(name) == looks]
    if len(places) == 1:
        return places[0] - 1
    if places:
        numbers = " and ".join(map(str, places))
        remedy = f"tell the number of the one that is meant: `column: {places[0]}` or {places[-1]}"
        found = f"the name '{column}' in columns {numbers}"
        return InputProblem(file, line, str(column), found, "each name once", remedy)
    known: Sequence[str] = names or [str(n + 1) for n in range(table.width)]
    remedy = "correct the name; look whether `form.names_line` is right"
    if not names:
        remedy = "tell the column's number, as `form.names_line` is 0"
    if len(names) == 1:
        remedy = f"is `form.delimiter` right? With {table.form.delimiter} the file has one column"
    if table.form.delimiter == "space" and " " in str(column):
        remedy = "a name ends at a blank there: tell the column's number"
    free = [name for name in names if name not in {one.column for one in channels}]
    remedy = (_where(table, channels) if names else "") or mistyped(str(column), free, remedy)
    return InputProblem(file, line, str(column), NO_COLUMN, one_of(known), remedy)


def _where(table: RawTable, channels: Sequence[Channel]) -> str:
    """The keys under which all names are found, if there is a line that has them."""
    form = table.form
    wanted = {_look(one.column) for one in channels if isinstance(one.column, str)}
    others = () if table.workbook else ("comma", "semicolon", "tab")
    for mark in dict.fromkeys((form.delimiter, *others)):
        rows = text_rows(form.model_copy(update={"delimiter": mark}), table.text)
        for line, cells in islice(rows, LOOKED_AT):
            if wanted <= set(map(_look, cells)):
                keys, doubt = f"delimiter: {mark}, ", "delimiter"
                if mark == form.delimiter:
                    keys, doubt = "", "names_line"
                found = f"All names are found with `form: {{{keys}names_line: {line}}}`"
                return f"is `form.{doubt}` right? {found}"
    return ""


def _look(name: str) -> str:
    """A name without what nobody sees: kinds of blanks, of micro signs, of composed letters."""
    return " ".join(normalize("NFKC", name).split())


def _numbers(
    table: RawTable,
    file: str,
    there: Sequence[tuple[Channel, int]],
) -> tuple[Lines, Lines, dict[str | int, Array], list[InputProblem]]:
    """Lines, rows, numbers by column, and problems of cells that have none."""
    notation = Notation(table.form.decimal, table.form.thousands)
    clocks = [one.unit == "clock" for one, _ in there]
    places = [place for _, place in there]
    plain = notation.thousands is None and not any(clocks)
    values = [clock_seconds if clock else notation.value for clock in clocks]
    lines, rows, numbers = table.columns(places, values, plain)
    columns = {one.column: values for (one, _), values in zip(there, numbers, strict=True)}
    bad = [np.flatnonzero(~np.isfinite(one)) for one in numbers]
    if table.form.empty_cells == "left_out":
        gaps = [at for at, (one, _) in enumerate(there) if isinstance(one, MotionChannel)]
        empty = {at: list[int]() for at in gaps if 0 < bad[at].size < len(lines)}
        for number, (_, _, texts) in enumerate(table.rows() if empty else ()):
            for at, gap in empty.items():
                if LOST.fullmatch(cell_at(texts, places[at])):
                    gap.append(number)
        for at, gap in empty.items():
            bad[at] = np.setdiff1d(bad[at], gap)
    if not any(one.size for one in bad):
        return lines, rows, columns, []
    # once more through the rows: the first bad cell of each column, and how numbers are written
    first = {(int(one[0]), at): "" for at, one in enumerate(bad) if one.size}

    def cells() -> Iterator[str]:
        for number, (_, _, row) in enumerate(table.rows()):
            for at, place in enumerate(places):
                if (number, at) in first:
                    first[number, at] = cell_at(row, place)
                if not clocks[at]:
                    yield cell_at(row, place)

    able = notations_of(cells())
    # rows at the top without any number
    units = int(np.isfinite(numbers).any(axis=0).argmax())
    problems = []
    for (row, at), cell in first.items():
        channel = there[at][0]
        found = f"'{cell}'" if cell else "an empty cell"
        if bad[at].size > 1:
            found += f" and {bad[at].size - 1} more such lines"
        allowed = f"a finite number with a decimal {notation.decimal} in every line"
        if clocks[at]:
            allowed = "a clock time in every line"
        what = remedy(
            cell, notation, able, channel.unit if isinstance(channel, TimeChannel) else ""
        )
        if not cell and bad[at].size == len(lines):
            what = "leave the column out"
            if table.workbook:
                what = "open and save it in a spreadsheet program, which stores values of formulas"
            elif isinstance(channel, TimeChannel):
                what = "leave `time` out: the machine wrote none"
        elif bad[at].size == units and not is_number(cell):
            what = f"{BELOW_UNITS} {lines[units]}}}`: no numbers stand above"
        problems.append(
            InputProblem(file, int(lines[row]), str(channel.column), found, allowed, what)
        )
    return lines, rows, columns, problems


def _backwards(time: Array, lines: Lines, file: str, column: str) -> Iterator[InputProblem]:
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        more = f", {back.size} times in all" if back.size > 1 else ""
        found = f"a time before that of the line above{more}"
        remedy = "look for recordings put one below the other, and give each its own file"
        yield InputProblem(file, int(lines[back[0] + 1]), column, found, "times that go on", remedy)


def _jumps(values: Array) -> NDArray[np.bool_]:
    """(N,) whether a reading is far from the running median, far beyond what a row moves on."""
    usual = medfilt(values, WINDOW)
    edge = WINDOW // 2
    usual[:edge], usual[-edge:] = values[:edge], values[-edge:]  # the filter knows none beyond
    away = np.abs(values - usual)
    steps = float(np.quantile(np.abs(np.diff(usual)), 0.95))
    return away > max(JUMP * float(np.ptp(usual)), 3.0 * steps, 10.0 * float(np.median(away)))


def _resolution(readings: Array) -> float:
    """Smallest step of readings that stand still from row to row, else the last decimal of all.

    Where rows are far apart, so are readings, however fine they are.
    """
    steps = np.diff(np.unique(readings))
    if steps.size and np.mean(np.diff(readings) == 0.0) > STANDING:
        return float(steps.min())
    return float(np.gcd.reduce(np.rint(1e6 * steps).astype(np.int64))) * 1e-6
