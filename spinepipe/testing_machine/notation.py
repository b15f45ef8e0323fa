"""Numbers and clock times as machines write them into cells, and what is wrong with other cells."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

_SIGNS = {"point": r"\.", "comma": ",", "space": "[ \u00a0\u202f]", "apostrophe": "['\u2019]"}
_FLAT = str.maketrans("23456789", "11111111")
_CLOCK = re.compile(
    r"(?:([0-9]{4})[-/]([0-9]{1,2})[-/]([0-9]{1,2})[T ]|"
    r"([0-9]{1,2})\.([0-9]{1,2})\.([0-9]{4}) )?"
    r"([0-9]{1,3}):([0-9]{2}):([0-9]{2}(?:[.,][0-9]*)?)Z?"
)
_UNIT = re.compile(r"[+-]?[0-9][0-9.,eE+-]*\s*[A-Za-zµμ°%][^0-9]*[0-9]?")
LOST = re.compile(r"[-+]?(nan(\(ind\))?|#?n/?a|#nv|null|-*)", re.IGNORECASE)
"""Cells for a reading that there is not."""

CLOCK = "clock times such as 12:34:56.7 or 2024-01-31 12:34:56.7, in `time: {unit: clock}`"
AS_TIME = "in the spreadsheet format the cells as time, and set `time: {unit: clock}`"
DAY = 86_400.0


@dataclass(frozen=True)
class Notation:
    """How numbers are written: the decimal sign, and what stands between thousands, if anything."""

    decimal: str
    thousands: str | None = None

    def __str__(self) -> str:
        """As it is set in the YAML."""
        end = f", thousands: {self.thousands}" if self.thousands else ""
        return f"{{decimal: {self.decimal}{end}}}"

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """Numbers, and nothing else: no nan, no 1_000, no digits of other scripts."""
        decimal = _SIGNS[self.decimal]
        plain = rf"([0-9]+({decimal}[0-9]*)?|{decimal}[0-9]+)([eE][+-]?[0-9]+)?"
        if self.thousands is None:
            return re.compile(f"[+-]?{plain}")
        grouped = rf"[1-9][0-9]{{0,2}}({_SIGNS[self.thousands]}[0-9]{{3}})+({decimal}[0-9]*)?"
        return re.compile(f"[+-]?({plain}|{grouped})")

    def value(self, cell: str) -> float:
        """The number in a cell, NaN where none is."""
        if not self.pattern.fullmatch(cell):
            return float("nan")
        if self.thousands is not None:
            cell = re.sub(_SIGNS[self.thousands], "", cell)
        return float(cell.replace(",", "."))


NOTATIONS = tuple(
    Notation(decimal, thousands)
    for decimal in ("point", "comma")
    for thousands in (None, *_SIGNS)
    if thousands != decimal
)


def is_number(cell: str) -> bool:
    """Whether a cell is a number in any notation."""
    return any(one.pattern.fullmatch(cell) for one in NOTATIONS)


def notations_of(cells: Iterable[str]) -> tuple[Notation, ...]:
    """Notations that read every cell that is a number in any; without thousands where that does."""
    able = set(NOTATIONS)
    for cell in cells:
        # a cell is read or not by where its signs stand, and whether it begins with a zero
        flat = cell.translate(_FLAT)
        able &= _readers(flat)
    spare = {one.decimal for one in able if one.thousands is None}
    return tuple(n for n in NOTATIONS if n in able and (not n.thousands or n.decimal not in spare))


@lru_cache(10_000)
def _readers(cell: str) -> frozenset[Notation]:
    readers = frozenset(one for one in NOTATIONS if one.pattern.fullmatch(cell))
    return readers or frozenset(NOTATIONS)


def clock_seconds(cell: str) -> float:
    """Seconds of a clock time, with those of its date where it has one; NaN where it is none."""
    found = _CLOCK.fullmatch(cell)
    if found is None:
        return float("nan")
    year, month, day, *german, hours, minutes, seconds = found.groups()
    if german[0]:
        day, month, year = german
    try:
        days = date(int(year), int(month), int(day)).toordinal() - 730_000 if year else 0
    except ValueError:  # no such day
        return float("nan")
    whole = int(hours) * 3600 + int(minutes) * 60
    return days * DAY + whole + float(seconds.replace(",", "."))


def past_midnight(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) seconds of a clock without dates, going on where it falls back by half a day or more."""
    back = np.diff(seconds, prepend=seconds[:1]) < -DAY / 2
    return seconds + DAY * np.cumsum(back)


def remedy(cell: str, now: Notation, able: Sequence[Notation], time_unit: str) -> str:
    """What to do about a cell that is no number as the YAML has it.

    Parameters
    ----------
    able : notations that read every number of the file: what is offered reads all of them.
    time_unit : of the column of time, empty for others.
    """
    if time_unit == "clock":
        to_unit = f"set its `unit` to s, ms or min; where they are days since 1900, {AS_TIME}"
        return to_unit if is_number(cell) else f"let the machine write {CLOCK}"
    if now.pattern.fullmatch(cell):
        return "correct it: no measured number is that large"
    if time_unit and not np.isnan(clock_seconds(cell)):
        return "set `time: {unit: clock}`: a clock time stands there"
    offered: Mapping[Notation, float] = {one: one.value(cell) for one in able if one != now}
    offered = {one: value for one, value in offered.items() if not np.isnan(value)}
    if len(set(offered.values())) > 1:
        words = " or ".join(f"`form: {one}` for {value:.10g}" for one, value in offered.items())
        return f"it can be read in two ways: set {words}"
    if offered:
        return f"set `form: {next(iter(offered))}`, which reads every number of this file"
    if is_number(cell):
        return (
            "numbers of this file are written in several ways, so that no `form` reads all of "
            "them: let the machine write it again with one decimal sign, or correct the cells"
        )
    if time_unit and re.search("[0-9]:[0-9]|[0-9][/.-][0-9]+[/.-][0-9]", cell):
        return f"let the machine write seconds, or {CLOCK}"
    if _UNIT.fullmatch(cell):
        return "take units out of the cells, each has one number; `unit:` tells the unit"
    if not re.search("[0-9]", cell):
        return (
            "no reading, and none is made up: take the lines out, or let the machine write it again"
        )
    return "correct the cells, or take the lines out"
