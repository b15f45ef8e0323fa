"""What a study concludes: records with their numbers, and the table of sentences that tells them.

A kind of study has one table of sentences, ``conclusions.csv``: a row for each verdict that a rule
can come to. Its rules (Python) look at tables of results and come to one verdict each, with the
numbers that made it; they hold no sentence. So each sentence has a rule that makes it and, in the
column ``false_if``, what would have to be true for it to be false.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from math import floor, isfinite, log10

import pandas as pd

from spinepipe.report.words import number, rounded_to

PLACES = ("answer", "key", "depends", "finding", "light", "methods")
"""Where on a page a sentence stands, from the top down."""

MOST_WORDS = 25
"""Of an answer and of a finding."""


_DUST = 1e-4
"""In any unit of the field (mm, degrees, N, N m, MPa, %)."""


@dataclass(frozen=True)
class Value:
    """A number of a conclusion.

    As text it has two digits of its interval's half-width, without an interval two significant
    ones; a whole number (a count) has all. ``{v}`` is number, interval and unit, ``{v:number}``,
    ``{v:interval}`` and ``{v:unit}`` (number with unit) are parts of that.

    Attributes
    ----------
    low, high : ends of the interval (95 % unless the sentence says otherwise); None where open.
    n : of how many it is the mean, median or share.
    source : the table that it is read from, and how: ``stiffness: median over specimens``.
    """

    number: float
    unit: str = ""
    low: float | None = None
    high: float | None = None
    n: int | None = None
    source: str = ""

    def __post_init__(self) -> None:
        """No NaN travels."""
        ends = [end for end in (self.low, self.high) if end is not None]
        if not all(map(isfinite, (self.number, *ends))):
            raise ValueError(f"{self}: a value of a conclusion is finite; an open end is None")

    def __format__(self, spec: str) -> str:
        """The number as a sentence has it, see above."""
        value, low, high = self._digits()
        parts = {"": "{value}{interval}{unit}", "number": "{value}", "unit": "{value}{unit}"}
        parts["interval"] = "{ends}"
        if spec not in parts:
            raise ValueError(f"{spec!r}; allowed: {', '.join(filter(None, parts))}")
        ends = {
            (False, False): "",
            (True, False): f"above {low}",
            (False, True): f"below {high}",
            (True, True): f"{low} to {high}",
        }[self.low is not None, self.high is not None]
        between = "" if self.unit == "°" else "\u00a0"
        words = self.unit.replace(" ", "\u00a0")  # no line breaks inside a unit
        unit = f"{between}{words}" if words else ""
        interval = f" ({ends})" if ends else ""
        return parts[spec].format(value=value, interval=interval, ends=ends, unit=unit)

    def _digits(self) -> tuple[str, str, str]:
        """Number and ends, rounded alike."""
        if self.low is None or self.high is None or self.high <= self.low:
            whole = float(self.number).is_integer() and abs(self.number) < 1e6
            tiny = abs(self.number) < _DUST  # nobody measures so little: what a solver leaves
            told = (
                rounded_to(self.number, 0 if whole else -2)
                if whole or tiny
                else number(self.number, 2)
            )
            low, high = ("" if x is None else number(x, 2) for x in (self.low, self.high))
            return told, low, high
        last = floor(log10(0.5 * (self.high - self.low))) - 1
        value, low, high = (rounded_to(x, last) for x in (self.number, self.low, self.high))
        return value, low, high


def numbers_from(source: str, **numbers: float) -> dict[str, Value]:
    """Numbers of a sentence that are read from one place, by their names in it."""
    return {name: Value(number, source=source) for name, number in numbers.items()}


@dataclass(frozen=True)
class Conclusion:
    """The verdict that a rule came to.

    Attributes
    ----------
    values : numbers of the sentence, by their names in it. names : words of it, such as a joint.
    """

    rule: str
    verdict: str
    values: Mapping[str, Value] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Sentence:
    """A row of the table of sentences.

    Attributes
    ----------
    place : one of `PLACES`. heading : of a light, what it judges.
    text : with ``{name}`` for each number or word of the conclusion.
    note : a second line: meaning of a key number, caveat of a finding.
    figure : that shows it. false_if : what would make it false.
    """

    place: str
    rule: str
    verdict: str
    heading: str
    text: str
    note: str
    figure: str
    false_if: str


@cache
def sentences_of(package: str) -> tuple[Sentence, ...]:
    """The table ``conclusions.csv`` of a kind of study, its most important rows first."""
    text = files(package).joinpath("conclusions.csv").read_text("utf-8")
    return tuple(Sentence(**row) for row in csv.DictReader(text.splitlines()))


@dataclass(frozen=True)
class Told:
    """A conclusion in words, at one place of a page; fields as of `Sentence`."""

    place: str
    rule: str
    verdict: str
    heading: str
    text: str
    note: str
    figure: str
    values: Mapping[str, Value]

    @property
    def level(self) -> str:
        """Of a light or a condition: ``ok``, ``check`` or ``stop``."""
        return self.verdict.partition("_")[0]

    @property
    def whole(self) -> str:
        """Heading and text in one, as the table ``conclusions`` has them."""
        return f"{self.heading}: {self.text}" if self.heading else self.text


def told(conclusions: Iterable[Conclusion], sentences: Sequence[Sentence]) -> list[Told]:
    """Conclusions in words, in the order of the table of sentences.

    One conclusion may stand at several places: in the answer and as a key number.

    Raises
    ------
    LookupError
        For a verdict without a sentence: nothing is concluded in silence.
    """
    rows: dict[tuple[str, str], list[tuple[int, Sentence]]] = {}
    for order, row in enumerate(sentences):
        rows.setdefault((row.rule, row.verdict), []).append((order, row))
    found = []
    for one in conclusions:
        if (one.rule, one.verdict) not in rows:
            raise LookupError(f"no sentence for rule {one.rule}, verdict {one.verdict}")
        words = {**one.values, **one.names}
        for order, row in rows[one.rule, one.verdict]:
            text, note = (part.format(**words) for part in (row.text, row.note))
            text = text[:1].upper() + text[1:]
            head = (row.place, row.rule, row.verdict, row.heading)
            in_words = Told(*head, text, note, row.figure, one.values)
            found.append((PLACES.index(row.place), order, in_words))
    return [one for _, _, one in sorted(found, key=lambda each: each[:2])]


def rows_of(conclusions: Iterable[Told]) -> list[dict[str, object]]:
    """Rows of the table ``conclusions``: one for each number, one of a sentence without any."""
    rows: list[dict[str, object]] = []
    for order, one in enumerate(conclusions):
        head = {"order": order, "place": one.place, "rule": one.rule, "verdict": one.verdict}
        head |= {"text": one.whole}
        for name, value in one.values.items() or (("", None),):
            parts = ("number", "unit", "low", "high", "n", "source")
            told_of = {part: None if value is None else getattr(value, part) for part in parts}
            told_of["value"] = told_of.pop("number")
            empty = {"unit": told_of["unit"] or "", "source": told_of["source"] or ""}
            rows.append({**head, "name": name, **told_of, **empty})
    return rows


def read_back(rows: pd.DataFrame) -> list[Told]:
    """Conclusions from rows of the table ``conclusions``; headings are part of their texts."""
    return [_read_one(of) for _, of in rows.groupby("order", sort=True)]


def _read_one(rows: pd.DataFrame) -> Told:
    """One sentence: a row for each of its numbers, or one that has none."""
    first = rows.iloc[0]
    place, rule, verdict, text = (str(first[key]) for key in ("place", "rule", "verdict", "text"))
    values = {}
    for row in rows[rows["value"].notna()].to_dict("records"):
        low, high = (_end(row[name]) for name in ("low", "high"))
        n = None if pd.isna(row["n"]) else int(row["n"])
        told_of = (float(row["value"]), row["unit"] or "", low, high, n, row["source"] or "")
        values[str(row["name"])] = Value(*told_of)
    return Told(place, rule, verdict, "", text, "", "", values)


def _end(cell: float | None) -> float | None:
    """An end of an interval; None where it is empty, or infinite in another program's file."""
    return float(cell) if cell is not None and pd.notna(cell) and isfinite(cell) else None
