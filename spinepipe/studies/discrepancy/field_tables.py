"""Tables of the page in the field's units: numbers of a curve, a formula, a law as a table."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from spinepipe.report.words import number
from spinepipe.schema import Column
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import EVERY, WithheldEffect
from spinepipe.studies.discrepancy.verdict_unnamed import Formula
from spinepipe.studies.discrepancy.words import TOWARDS, general, motion_of, readable
from spinepipe.units import DEG_PER_RAD, LOAD_UNITS

Shown = tuple[pd.DataFrame, tuple[Column, ...]]
"""Rows and columns of a table of the page."""

NUMBERS_ABOUT = (
    "Read off the curve of the model with the effects, joint by joint, whatever the formula of its "
    "law: mean over specimens [95 % interval]. Break: the motion at which stiffness is half way "
    "from that at rest to that at the load; zone: the distance of the breaks; drift: from 1 to 10 "
    "minutes under the load, of the motion at once. Each specimen, and the base, are in "
    "field_numbers.parquet."
)
TABULATED_ABOUT = (
    "The load that holds a joint at a motion, springs and named effects included: mean over "
    "specimens [95 % interval], and that of the base model. It describes what has no name, and is "
    "none. Each specimen is in tabulated.parquet."
)
FORMULA_ABOUT = (
    "The few terms that describe what has no name: load that holds the joint = coefficient times "
    "term. A positive coefficient resists."
)
WITHHELD_ABOUT = (
    "Each would be evident were an imperfection known better. What that takes, kind by kind; by "
    "measuring it, not on paper."
)

_WORDS = {
    "stiffness_at_zero": "stiffness at rest",
    "stiffness_at": "stiffness at {load}",
    "motion_at": "motion at {load}",
    "break": "break",
    "zone": "zone, from break to break",
    "loop_area": "loop area, between ±{load}",
    "drift_per_decade": "drift per decade of time at {load}",
}
_SIDED = ("stiffness_at", "motion_at", "break")
_UNITS = {"N m/deg": "N m/°", "deg": "°", "N m deg": "N m °", "1": "%"}
_RAD = re.compile(r"rad(?:\^(\d))?")
_COEFFICIENT = re.compile(r"([+-]?\d[\d.e+-]*) \(SD ([\d.e+-]+)\) ([^*;=]+?) \* ")
_PRINTED = (("^2", "²"), ("^3", "³"), (" * ", " × "), (" x ", " × "))


def numbers_table(rows: pd.DataFrame) -> Shown:
    """A row for each number of a coordinate, a column for each joint.

    Parameters
    ----------
    rows : of the table field_numbers.
    """
    if rows.empty:
        return rows, ()
    means = rows[(rows["specimen"] == EVERY[0]) & (rows["model"] == MODELS[1])]
    cells: dict[tuple[str, ...], dict[str, str]] = {}
    for (coordinate, joint), part in means.groupby(["coordinate", "joint"], sort=False):
        for key, text in _of_joint(str(coordinate), part.to_dict("records")):
            cells.setdefault(key, {})[str(joint)] = text
    return _matrix(cells, ("motion", "number", "unit"))


def _of_joint(
    coordinate: str, rows: Sequence[Mapping[Any, Any]]
) -> Iterator[tuple[tuple[str, str, str], str]]:
    """(motion, number, unit) and the cell; sides that are alike are told once."""
    told = {row["number"]: row for row in rows}
    for name, row in told.items():
        kind, _, side = name.rpartition("_")
        words = _WORDS.get(name) or _WORDS[kind]
        other = told.get(f"{kind}_{'plus' if side == 'minus' else 'minus'}")
        if kind in _SIDED and name not in _WORDS:
            if other is not None and (
                abs(abs(row["value"]) - abs(other["value"])) <= 1e-6 * abs(row["value"])
            ):
                if side == "minus":
                    continue
                words += ", to either side"
            else:
                words += f", {TOWARDS[coordinate][side == 'minus']}"
        load = f"{row['load']:.3g} {LOAD_UNITS[coordinate]}"
        unit = _UNITS.get(row["unit"], row["unit"])
        yield (motion_of(coordinate), words.format(load=load), unit), _cell(row)


def _cell(row: Mapping[Any, Any], name: str = "value") -> str:
    """``3.1 [2.8, 3.4]``."""
    share = 100.0 if row.get("unit") == "1" else 1.0
    value = number(share * row[name])
    if row.get("at_bound"):
        return f"{value}, at a bound"
    if pd.isna(row["low"]):
        return f"{value} [not known]"
    return f"{value} [{number(share * row['low'])}, {number(share * row['high'])}]"


def _matrix(cells: Mapping[tuple[str, ...], Mapping[str, str]], names: Sequence[str]) -> Shown:
    """Keys and a column for each joint; one column for all where they have the same."""
    joints = list(dict.fromkeys(joint for row in cells.values() for joint in row))
    same = len(joints) > 1 and all(
        len(row) == len(joints) and len(set(row.values())) == 1 for row in cells.values()
    )
    shown = ["every joint"] if same else joints
    rows = [
        dict(zip(names, key, strict=True))
        | ({"every joint": row[joints[0]]} if same else {j: row.get(j, "") for j in joints})
        for key, row in cells.items()
    ]
    columns = [Column(name, "text", name) for name in names]
    columns += [Column(joint, "text", "value [95 % interval]") for joint in shown]
    return pd.DataFrame(rows), tuple(columns)


def tabulated_table(rows: pd.DataFrame) -> Shown:
    """A row for each motion, a column for each joint: the load with the table, and the base's.

    Parameters
    ----------
    rows : of the table tabulated.
    """
    if rows.empty:
        return rows, ()
    cells: dict[tuple[str, ...], dict[str, str]] = {}
    for row in rows[rows["specimen"] == EVERY[0]].to_dict("records"):
        load = f"{motion_of(row['coordinate'])} ({row['load_unit']})"
        unit = _UNITS.get(row["motion_unit"], row["motion_unit"])
        key = (load, motion_of(row["over"]), f"{number(row['motion'])} {unit}")
        if row["motion"]:
            text = f"{_cell(row, 'load')}, base {number(row['base'])}"
            cells.setdefault(key, {})[row["joint"]] = text
    frame, columns = _matrix(cells, ("load", "over", "at"))
    return frame, columns


def formula_table(formula: Formula | None) -> Shown:
    """A row for each term."""
    rows = []
    for term in () if formula is None else formula.terms:
        joint = "every joint" if term.joint == EVERY[0] else term.joint
        value, unit = per_degree(term.coefficient, term.unit)
        sd, _ = per_degree(term.sd, term.unit)
        rows.append(
            {
                "place": joint if term.specimen == EVERY[0] else f"{joint} of {term.specimen}",
                "on": f"{'reading' if term.acts == 'reading' else 'load'} in "
                f"{motion_of(term.coordinate)}",
                "term": typeset(readable(term.term)),
                "coefficient": f"{number(value)} (SD {number(sd, 2)})",
                "unit": unit,
                "explained": 100.0 * term.explained,
            }
        )
    columns = (
        Column("place", "text", "joint and specimen"),
        Column("on", "text", "what the term adds to"),
        Column("term", "text", "what the coefficient multiplies; motions in ° and mm"),
        Column("coefficient", "text", "coefficient (one SD)"),
        Column("unit", "text", "unit of the coefficient"),
        Column("explained", "number", "share of the excess misfit (chi squared) that it adds", "%"),
    )
    return pd.DataFrame(rows), columns


def per_degree(value: float, unit: str) -> tuple[float, str]:
    """A coefficient by radians as one by degrees, and its unit as it is printed."""
    below = unit.partition("/")[2]
    powers = sum(int(found[1] or 1) for found in _RAD.finditer(below))
    told = _RAD.sub(lambda at: "°" + ("²" if at[1] == "2" else "³" if at[1] == "3" else ""), unit)
    return value / DEG_PER_RAD**powers, typeset(told)


def typeset(text: str) -> str:
    """Powers and products as they are printed."""
    for typed, shown in _PRINTED:
        text = text.replace(typed, shown)
    return text


def formula_text(formula: Formula) -> str:
    """The formula in one line, by degrees."""

    def told(at: re.Match[str]) -> str:
        value, unit = per_degree(float(at[1]), at[3])
        sd, _ = per_degree(float(at[2]), at[3])
        return f"{number(value)} (SD {number(sd, 2)}) {unit} × "

    return typeset(_COEFFICIENT.sub(told, readable(formula.text)))


def withheld_table(effects: Sequence[WithheldEffect]) -> Shown:
    """A row for each effect and kind of imperfection."""
    rows = [
        {
            "effect": general(one.name),
            "imperfection": general(one.imperfection),
            "allowed": _size(one.allowed, one.unit),
            "would have to be known to": "this alone does not do"
            if one.known_to is None
            else _size(one.known_to, one.unit),
            "log_evidence": one.log_evidence,
            "if known": one.log_evidence_if_known,
        }
        for one in effects
    ]
    columns = (
        Column("effect", "text", "effect that is withheld"),
        Column("imperfection", "text", "what hides it"),
        Column("allowed", "text", "one prior SD of it, as the study says"),
        Column("would have to be known to", "text", "largest SD at which it would be evident"),
        Column("log_evidence", "number", "as things are"),
        Column("if known", "number", "log evidence were the imperfection known exactly"),
    )
    return pd.DataFrame(rows), columns


def _size(value: float, unit: str) -> str:
    if unit == "1":
        return f"{number(100.0 * value, 2)} %"
    return f"{number(value, 2)} {_UNITS.get(unit, unit)}"
