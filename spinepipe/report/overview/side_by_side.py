"""Two studies side by side: settings, conclusions, code and data, tables; what of them differs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from math import inf
from typing import Any

import pandas as pd
import yaml

from spinepipe.report.conclusions import Told, Value
from spinepipe.report.words import count

VERDICT, APART, VALUE, ONE = (
    "verdict differs",
    "intervals do not overlap",
    "value differs",
    "one side only",
)
"""How conclusions differ, the most important first."""

MOST_COLUMNS = 8
"""Of a table, that are named."""

NONE = "–"
"""Stands where a side has nothing."""

_VERSION = "version_"
_DIGESTS = ("code", "data")


@dataclass(frozen=True)
class StudyDifference:
    """Something with a name that two sides have differently, as text; `NONE` where one lacks it."""

    name: str
    a: str
    b: str


@dataclass(frozen=True)
class ValuePair:
    """A number of a conclusion on both sides; ``remark`` is empty where they are alike."""

    name: str
    a: str
    b: str
    remark: str


@dataclass(frozen=True)
class Pair:
    """What both sides conclude by the same rule.

    Attributes
    ----------
    remarks : in which ways they differ (`VERDICT`, `APART`, `VALUE`, `ONE`); none where alike.
    """

    rule: str
    place: str
    a: Told | None
    b: Told | None
    values: tuple[ValuePair, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class TableCount:
    """How much of a table differs.

    Attributes
    ----------
    rows : of a and of b; None where a side has no such table. only : rows of one side alone.
    cells : differing ones of rows that both have. columns : their numbers by column, most first.
    """

    name: str
    rows: tuple[int | None, int | None]
    only: tuple[int, int]
    cells: int
    columns: Mapping[str, int]

    @property
    def words(self) -> str:
        """What differs, in half a sentence."""
        for side, other in (("a", 1), ("b", 0)):
            if self.rows[other] is None:
                return f"only in {side}"
        told = [f"{self.cells:,} cells differ"] if self.cells else []
        named = [f"{column} {number:,}" for column, number in self.columns.items()]
        more = len(named) - MOST_COLUMNS
        if named:
            rest = f", {more} more columns" if more > 0 else ""
            told[-1] += f" ({', '.join(named[:MOST_COLUMNS])}{rest})"
        told += [
            f"{number:,} rows only in {side}"
            for side, number in zip("ab", self.only, strict=True)
            if number
        ]
        return "; ".join(told) or "equal"


@dataclass(frozen=True)
class SideBySide:
    """Two studies, a and b.

    Attributes
    ----------
    names, kinds : of a and of b.
    settings : that differ. settings_note : why none are told, or which are left out; or empty.
    conclusions : all, by rule. origin : seed, versions, and by table digests of code and of data.
    tables : all that both have, or one side has. left_out : tables that cannot be compared.
    """

    names: tuple[str, str]
    kinds: tuple[str, str]
    settings: Sequence[StudyDifference]
    settings_note: str
    conclusions: Sequence[Pair]
    origin: Sequence[StudyDifference]
    tables: Sequence[TableCount]
    left_out: Sequence[str] = ()

    @property
    def changed(self) -> list[Pair]:
        """Conclusions that differ, the most important difference first."""
        order = (VERDICT, APART, ONE, VALUE)
        found = [one for one in self.conclusions if one.remarks]
        return sorted(found, key=lambda one: min(map(order.index, one.remarks)))

    @property
    def alike(self) -> list[Pair]:
        """Conclusions that are the same."""
        return [one for one in self.conclusions if not one.remarks]

    @property
    def other_tables(self) -> list[TableCount]:
        """Tables that differ."""
        return [one for one in self.tables if one.words != "equal"]

    @property
    def is_equal(self) -> bool:
        """Whether nothing that was compared differs."""
        return not (self.settings or self.changed or self.origin or self.other_tables)

    @property
    def summary(self) -> str:
        """What differs, in one sentence."""
        if self.is_equal:
            return "Nothing changed."
        remarks = [remark for one in self.changed for remark in one.remarks]
        told = [
            (len(self.settings), "setting", "settings"),
            (remarks.count(VERDICT), "verdict", "verdicts"),
            (remarks.count(APART), "conclusion without overlap", "conclusions without overlap"),
            (len(self.other_tables), "table", "tables"),
        ]
        parts = [count(number, one, many) for number, one, many in told if number]
        return f"Different: {', '.join(parts) or 'code, data or versions alone'}."


def paired(a: Sequence[Told], b: Sequence[Told], one_kind: bool) -> list[Pair]:
    """Conclusions held together by their rule, in the order of a's page, what b adds behind them.

    A rule whose verdict stands at several places counts once, at the first; one that came to
    several verdicts there, first with first. Answers are held together whatever made them. Of two
    kinds those of rules that both have are told.
    """
    sides = _by_rule(a), _by_rule(b)
    found = [
        _pair(rule, one, other)
        for rule in dict.fromkeys([*sides[0], *sides[1]])
        for one, other in zip_longest(sides[0].get(rule, []), sides[1].get(rule, []))
    ]
    return [one for one in found if one_kind or (one.a and one.b)]


def _by_rule(told: Sequence[Told]) -> dict[str, list[Told]]:
    places: dict[str, str] = {}
    found: dict[str, list[Told]] = {}
    for one in told:
        rule = "" if one.place == "answer" else one.rule
        if places.setdefault(rule, one.place) == one.place:
            found.setdefault(rule, []).append(one)
    answers = {one.rule for one in found.get("", [])}
    return {rule: found[rule] for rule in found if rule not in answers}


def _pair(rule: str, a: Told | None, b: Told | None) -> Pair:
    one = a or b
    assert one is not None
    if a is None or b is None:
        return Pair(one.rule, one.place, a, b, (), (ONE,))
    names = dict.fromkeys([*a.values, *b.values])
    values = tuple(_values(name, a.values.get(name), b.values.get(name)) for name in names)
    remarks = [VERDICT] if (a.rule, a.verdict) != (b.rule, b.verdict) else []
    remarks += [remark for remark in (APART, VALUE) if any(v.remark == remark for v in values)]
    if not remarks and a.text != b.text:
        remarks = [VALUE]  # a word of it, such as the name of a joint
    return Pair(one.rule, one.place, a, b, values, tuple(remarks))


def _values(name: str, a: Value | None, b: Value | None) -> ValuePair:
    left, right = (NONE if one is None else f"{one}" for one in (a, b))
    if a and b and (a.number, a.unit, a.low, a.high) == (b.number, b.unit, b.low, b.high):
        return ValuePair(name, left, right, "")
    return ValuePair(name, left, right, APART if a and b and are_apart(a, b) else VALUE)


def are_apart(a: Value, b: Value) -> bool:
    """Whether two intervals, in the same unit, have no number in common.

    An end that is open holds all; a value without any end has no interval, and nothing is told.
    """
    if a.unit != b.unit or any(one.low is None and one.high is None for one in (a, b)):
        return False

    def ends(one: Value) -> tuple[float, float]:
        return -inf if one.low is None else one.low, inf if one.high is None else one.high

    return max(ends(a)[0], ends(b)[0]) > min(ends(a)[1], ends(b)[1])


def settings_that_differ(
    a: Mapping[str, Any], b: Mapping[str, Any], one_kind: bool
) -> list[StudyDifference]:
    """Settings by dotted names, without that of the study; of two kinds those that both have."""
    left, right = (dict(_flat(one)) for one in (a, b))
    names = [name for name in dict.fromkeys([*left, *right]) if name not in ("study", "kind")]
    if not one_kind:
        names = [name for name in names if name in left and name in right]
    told = (StudyDifference(name, left.get(name, NONE), right.get(name, NONE)) for name in names)
    return [one for one in told if one.a != one.b]


def _flat(settings: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for name, value in settings.items():
        if isinstance(value, Mapping) and value:
            yield from _flat(value, f"{above}{name}.")
        else:
            text = yaml.safe_dump(value, default_flow_style=True, width=inf, allow_unicode=True)
            yield f"{above}{name}", text.removesuffix("...\n").strip()


def origins_that_differ(
    a: Mapping[str, Mapping[str, str]], b: Mapping[str, Mapping[str, str]]
) -> list[StudyDifference]:
    """What metadata of tables say: seeds, versions, and which tables other code or data made.

    Digests of settings are left out: they hold the study's name, and settings are told by name.
    """
    facts = sorted({name for told in (*a.values(), *b.values()) for name in told})
    found = []
    for name in (name for name in facts if name == "seed" or name.startswith(_VERSION)):
        sides = (sorted({told.get(name, "") for told in one.values()}) for one in (a, b))
        left, right = (", ".join(filter(None, one)) or NONE for one in sides)
        found.append(StudyDifference(name.removeprefix(_VERSION), left, right))
    for what in _DIGESTS:
        key = f"{what}_digest"
        for name in (name for name in a if name in b):
            left, right = (one[name].get(key, NONE)[:12] for one in (a, b))
            found.append(StudyDifference(f"{what} of {name}", left, right))
    return [one for one in found if one.a != one.b]


def counted(
    differences: pd.DataFrame, rows: Mapping[str, tuple[int | None, int | None]]
) -> list[TableCount]:
    """Tables with the numbers of what differs in each.

    Parameters
    ----------
    differences : as `spinepipe.compare` gives them. rows : of each table, of a and of b.
    """
    found = []
    for name, both in rows.items():
        of = differences[differences["table"] == name]
        cells = of[of["column"] != ""]
        whole = of[(of["column"] == "") & (of["key"] != "")]
        only = int((whole["a"] == "only in a").sum()), int((whole["b"] == "only in b").sum())
        columns = {str(column): int(n) for column, n in cells["column"].value_counts().items()}
        found.append(TableCount(name, both, only, len(cells), columns))
    return found
