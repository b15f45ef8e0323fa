"""Numbers that a tester reads off the curves of fitted joints, with intervals.

A number is that of the joint with all laws that the model has there.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinepipe.effects import Effect
from spinepipe.effects.contract import Array, JointLaw, PathLaw
from spinepipe.effects.field_numbers import NUMBERS, numbers_of, usual_load
from spinepipe.studies.discrepancy.read_off import Laws, laws_at, mean_of, told
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.studies.discrepancy.verdict import EVERY, FieldNumber
from spinepipe.units import COORDINATES, DEG_PER_RAD, LOAD_UNITS, MM_PER_M, TRANSLATIONS

Row = dict[str, Any]

NEARLY = 0.8
"""Share of the usual load from which tests are said to reach it."""

ONE_SIDED = 0.05
"""Share of the load that a side must have seen, for numbers to be told of it."""

_NOT_NEGATIVE = ("zone", "loop_area")
_SIDES = {"minus": 0, "plus": 1}


@dataclass(frozen=True)
class LoadRange:
    """Loads that tests put on a coordinate of a joint, N m or N: lowest and highest, 0 within."""

    low: float
    high: float

    @property
    def largest(self) -> float:
        """To either side."""
        return max(-self.low, self.high)


Reaches = Mapping[tuple[str, str], LoadRange]
"""By joint and coordinate."""


def reaches(gap: Sequence[Row]) -> Reaches:
    """What the tests load: of rows of the table gap, listed or, on a rig, measured.

    Parameters
    ----------
    gap : its rows, with `joint`, `coordinate`, `unit`, `load` and `measured`.
    """
    found: dict[tuple[str, str], LoadRange] = {}
    for row in gap:
        on_a_rig = row["unit"] == LOAD_UNITS[row["coordinate"]]
        load = row["measured"] if on_a_rig else row["load"]
        key = row["joint"], row["coordinate"]
        before = found.get(key, LoadRange(0.0, 0.0))
        found[key] = LoadRange(min(before.low, load), max(before.high, load))
    return found


def field_number_rows(
    base: JointFit, final: JointFit, forms: Sequence[CandidateForm], tested: Reaches
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


def _specimens(fit: JointFit, forms: Sequence[CandidateForm], joint: int) -> Iterator[str]:
    """Specimens in which one of the forms acts on the joint."""
    for name in fit.models:
        if any(form.acts_in(name) and form.joint in (None, joint) for form in forms):
            yield name


def numbers_at(
    rows: Sequence[Row], form: CandidateForm, joints: Sequence[str]
) -> tuple[FieldNumber, ...]:
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
    form: CandidateForm, joints: Sequence[str], tested: Reaches
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


def _changes(fit: JointFit, form: CandidateForm, joint: int, coordinate: str, load: float) -> bool:
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


def _of_place(
    place: Row, fit: JointFit, specimens: Sequence[str], reach: LoadRange
) -> Iterator[Row]:
    """Rows of each specimen, and of their mean, at a joint, coordinate and load."""
    coordinate, load = place["coordinate"], place["load"]
    found = told(fit, specimens, place["joint"], lambda laws: _read(laws, coordinate, load))
    spread = covariance(fit)
    for number, name in enumerate(NUMBERS):
        if not _seen(name, reach, load):
            continue
        there = {s: one for s, one in found.items() if np.isfinite(one.values[number])}
        groups = [(specimen, [one]) for specimen, one in there.items()]
        for specimen, ones in [*groups, *([(EVERY[0], list(there.values()))] if there else [])]:
            value, away = mean_of(ones, number, spread)
            yield {
                **place,
                "specimen": specimen,
                "number": name,
                "specimens": len(ones),
                "at_bound": any(bool(one.at_bound[number]) for one in ones),
                **_in_field_units(name, coordinate, value, away),
            }


def _seen(number: str, reach: LoadRange, load: float) -> bool:
    """Whether tests loaded the side, or the sides, that a number tells of."""
    sides = (-reach.low > ONE_SIDED * load, reach.high > ONE_SIDED * load)
    if number in ("zone", "loop_area"):
        return all(sides)
    side = _SIDES.get("plus" if number == "drift_per_decade" else number.rpartition("_")[2])
    return side is None or sides[side]


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
