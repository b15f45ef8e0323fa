"""Numbers that a tester reads off the curves of fitted joints, with intervals.

A number is that of the joint with all laws that the model has there. How it follows each fitted
value is found by moving that value a little both ways and reading it off again; with the covariance
of the fit that makes its interval (delta method).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinepipe.effects import Effect
from spinepipe.effects.contract import Array, JointLaw, PathLaw
from spinepipe.effects.field_numbers import NUMBERS, numbers_of, usual_load
from spinepipe.model import SpineModel
from spinepipe.statics import moved
from spinepipe.studies.discrepancy.search.hypothesis import Form
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import NORMAL_95, covariance
from spinepipe.studies.discrepancy.verdict import EVERY, FieldNumber
from spinepipe.units import COORDINATES, DEG_PER_RAD, LOAD_UNITS, MM_PER_M, TRANSLATIONS

Row = dict[str, Any]

STEP = 0.05
"""Standard errors that a fitted value is moved by."""

NEARLY = 0.8
"""Share of the usual load from which tests are said to reach it."""

ONE_SIDED = 0.05
"""Share of the load that a side must have seen, for numbers to be told of it."""

_NOT_NEGATIVE = ("zone", "loop_area")
_SIDES = {"minus": 0, "plus": 1}


@dataclass(frozen=True)
class Reach:
    """Loads that tests put on a coordinate of a joint, N m or N: lowest and highest, 0 within."""

    low: float
    high: float

    @property
    def largest(self) -> float:
        """To either side."""
        return max(-self.low, self.high)


Reaches = Mapping[tuple[str, str], Reach]
"""By joint and coordinate."""


def reaches(gap: Sequence[Row]) -> Reaches:
    """What the tests load: of rows of the table gap, listed or, on a rig, measured.

    Parameters
    ----------
    gap : its rows, with `joint`, `coordinate`, `unit`, `load` and `measured`.
    """
    found: dict[tuple[str, str], Reach] = {}
    for row in gap:
        on_a_rig = row["unit"] == LOAD_UNITS[row["coordinate"]]
        load = row["measured"] if on_a_rig else row["load"]
        key = row["joint"], row["coordinate"]
        before = found.get(key, Reach(0.0, 0.0))
        found[key] = Reach(min(before.low, load), max(before.high, load))
    return found


def field_number_rows(
    base: JointFit, final: JointFit, forms: Sequence[Form], tested: Reaches
) -> list[Row]:
    """Numbers of both models where forms that stand change a curve that tests load.

    Parameters
    ----------
    base, final : fits without and with the forms.
    """
    joints = next(iter(final.models.values())).joints
    places = {place: load for form in forms for place, load in _places(form, joints, tested)}
    changed = {
        (joints[joint], coordinate): load
        for (joint, coordinate), load in places.items()
        if any(_changes(final, form, joint, coordinate, load) for form in forms)
    }
    return [
        row
        for name, fit in (("base", base), ("with_effects", final))
        for (joint, coordinate), load in changed.items()
        for row in _of_place(
            {"model": name, "joint": joint, "coordinate": coordinate, "load": load},
            fit,
            tuple(_specimens(fit, forms, joints.index(joint))),
            tested[joint, coordinate],
        )
    ]


def _specimens(fit: JointFit, forms: Sequence[Form], joint: int) -> Iterator[str]:
    """Specimens in which one of the forms acts on the joint."""
    for name in fit.models:
        if any(form.acts_in(name) and form.joint in (None, joint) for form in forms):
            yield name


def numbers_at(rows: Sequence[Row], form: Form, joints: Sequence[str]) -> tuple[FieldNumber, ...]:
    """Means over specimens, with the effects, where a form acts."""
    own = joints if form.joint is None else (joints[form.joint],)
    on = form.variant.acts_on or COORDINATES
    return tuple(
        FieldNumber(
            row["number"],
            row["joint"],
            row["coordinate"],
            row["specimens"],
            row["load"],
            row["value"],
            row["unit"],
            None if row["low"] is None else (row["low"], row["high"]),
        )
        for row in rows
        if row["model"] == "with_effects" and row["specimen"] == EVERY[0]
        if row["joint"] in own and row["coordinate"] in on
    )


def _places(
    form: Form, joints: Sequence[str], tested: Reaches
) -> Iterator[tuple[tuple[int, str], float]]:
    """Joint and coordinate that a law may change and tests load, and the load to tell it at."""
    if not isinstance(form.variant.create(), JointLaw | PathLaw):
        return
    own = range(len(joints)) if form.joint is None else (form.joint,)
    for coordinate in form.variant.acts_on or COORDINATES:
        seen = [tested[at].largest for j in own if (at := (joints[j], coordinate)) in tested]
        usual = usual_load(coordinate)
        least = min((load for load in seen if load > ONE_SIDED * usual), default=0.0)
        if least > 0.0:
            load = usual if least >= NEARLY * usual else least
            yield from (((j, coordinate), load) for j in own if (joints[j], coordinate) in tested)


def _changes(fit: JointFit, form: Form, joint: int, coordinate: str, load: float) -> bool:
    """Whether the curve is another one without the form's law."""
    if form.joint not in (None, joint):
        return False
    law = form.variant.create()
    for name, model in fit.models.items():
        laws = laws_at(model, joint)
        rest = [one for one in laws if one[0] != law]
        if form.acts_in(name) and rest and len(rest) < len(laws):
            with_it, without = _read([laws, rest], coordinate, load)
            if not np.allclose(with_it, without, rtol=1e-9, atol=0.0, equal_nan=True):
                return True
    return False


Laws = list[tuple[Effect, Array]]


def laws_at(model: SpineModel, joint: int) -> Laws:
    """Laws of a joint in all tests, with their parameters (P,), in order."""
    return [
        (one.effect, one.values[one.joints.index(joint) if one.effect.per_joint else 0])
        for one in model.effects
        if isinstance(one.effect, JointLaw | PathLaw) and joint in one.joints
        if one.tests == EVERY
    ]


def _read(joints: Sequence[Laws], coordinate: str, load: float) -> list[Array]:
    """(N,) numbers of each joint in the order of `NUMBERS`; joints with the same laws together."""
    alike: dict[tuple[Effect, ...], list[int]] = {}
    for index, laws in enumerate(joints):
        alike.setdefault(tuple(effect for effect, _ in laws), []).append(index)
    found: list[Array] = [np.empty(0)] * len(joints)
    for effects, members in alike.items():
        stacked = [
            (effect, np.stack([joints[m][k][1] for m in members]))
            for k, effect in enumerate(effects)
        ]
        told = numbers_of(stacked, coordinate, load)
        table = np.stack([told[number] for number in NUMBERS], axis=1)
        for member, values in zip(members, table, strict=True):
            found[member] = values
    return found


@dataclass(frozen=True)
class _Told:
    """Numbers (N,) of a joint of a specimen, their slopes (N, m) by all unknowns, and whether a
    number hangs on one at a bound (N,)."""

    values: Array
    slopes: Array
    at_bound: Array


def _of_place(place: Row, fit: JointFit, specimens: Sequence[str], reach: Reach) -> Iterator[Row]:
    """Rows of each specimen, and of their mean, at a joint, coordinate and load."""
    coordinate, load = place["coordinate"], place["load"]
    told = _told(fit, specimens, place["joint"], coordinate, load)
    spread = covariance(fit)
    for number, name in enumerate(NUMBERS):
        if not _seen(name, reach, load):
            continue
        there = {s: one for s, one in told.items() if np.isfinite(one.values[number])}
        groups = [(specimen, [one]) for specimen, one in there.items()]
        for specimen, ones in [*groups, *([(EVERY[0], list(there.values()))] if there else [])]:
            value = float(np.mean([one.values[number] for one in ones]))
            slope = np.mean([one.slopes[number] for one in ones], axis=0)
            variance = float(slope @ spread @ slope)
            away = NORMAL_95 * np.sqrt(variance) if np.isfinite(variance) else None
            yield {
                **place,
                "specimen": specimen,
                "number": name,
                "specimens": len(ones),
                "at_bound": any(bool(one.at_bound[number]) for one in ones),
                **_in_field_units(name, coordinate, value, away),
            }


def _seen(number: str, reach: Reach, load: float) -> bool:
    """Whether tests loaded the side, or the sides, that a number tells of."""
    sides = (-reach.low > ONE_SIDED * load, reach.high > ONE_SIDED * load)
    if number in ("zone", "loop_area"):
        return all(sides)
    side = _SIDES.get("plus" if number == "drift_per_decade" else number.rpartition("_")[2])
    return side is None or sides[side]


def _told(
    fit: JointFit, specimens: Sequence[str], joint: str, coordinate: str, load: float
) -> dict[str, _Told]:
    """Numbers by specimen, read off where the fit stands and beside it."""
    errors = np.sqrt(np.diagonal(covariance(fit)))
    asked: list[tuple[str, int | None, float]] = []
    curves: list[Laws] = []
    for specimen in specimens:
        member = fit.hypothesis.members[specimen]
        at = fit.models[specimen].joints.index(joint)
        own = fit.x[list(member.numbers)]
        here = laws_at(moved(member.model, member.free, own), at)
        asked.append((specimen, None, 0.0))
        curves.append(here)
        for place, unknown in enumerate(member.numbers):
            limits = fit.hypothesis.unknowns[unknown]
            for side in (-1.0, 1.0):
                to = np.clip(own[place] + side * STEP * errors[unknown], limits.low, limits.high)
                there = laws_at(moved(member.model, member.free, _with(own, place, to)), at)
                if any(np.any(a != b) for (_, a), (_, b) in zip(here, there, strict=True)):
                    asked.append((specimen, unknown, float(to - own[place])))
                    curves.append(there)
    read = _read(curves, coordinate, load)
    return {
        specimen: _one(fit, specimen, asked, read)
        for specimen, unknown, _ in asked
        if unknown is None
    }


def _with(x: Array, place: int, value: float) -> Array:
    changed = x.copy()
    changed[place] = value
    return changed


def _one(
    fit: JointFit, specimen: str, asked: Sequence[tuple[str, int | None, float]], read: list[Array]
) -> _Told:
    values = next(
        found
        for (name, unknown, _), found in zip(asked, read, strict=True)
        if name == specimen and unknown is None
    )
    beside: dict[int, list[tuple[float, Array]]] = {}
    for (name, unknown, away), found in zip(asked, read, strict=True):
        if name == specimen and unknown is not None:
            beside.setdefault(unknown, []).append((away, found))
    slopes, at_bound = np.zeros((len(values), len(fit.x))), np.zeros(len(values), dtype=bool)
    for unknown, sides in beside.items():
        (low, first), (high, last) = sides if len(sides) == 2 else ((0.0, values), sides[0])
        slopes[:, unknown] = (last - first) / (high - low)
        at_bound |= fit.at_bound[unknown] & (slopes[:, unknown] != 0.0)
    return _Told(values, slopes, at_bound)


def _in_field_units(name: str, coordinate: str, value: float, away: float | None) -> Row:
    """Value and interval in the units that testers write."""
    unit, factor = unit_of(name, coordinate)
    if away is None:
        return {"value": value * factor, "unit": unit, "low": None, "high": None}
    low = max(value - away, 0.0) if name in _NOT_NEGATIVE else value - away
    return {
        "value": value * factor,
        "unit": unit,
        "low": low * factor,
        "high": (value + away) * factor,
    }


def unit_of(name: str, coordinate: str) -> tuple[str, float]:
    """Unit of a number of a coordinate in tables, and what one SI unit is in it."""
    shift = coordinate in TRANSLATIONS
    if name == "drift_per_decade":
        return "1", 1.0
    if name == "loop_area":
        return ("J", 1.0) if shift else ("N m deg", DEG_PER_RAD)
    if name.startswith("stiffness"):
        return ("N/mm", 1.0 / MM_PER_M) if shift else ("N m/deg", 1.0 / DEG_PER_RAD)
    return ("mm", MM_PER_M) if shift else ("deg", DEG_PER_RAD)
