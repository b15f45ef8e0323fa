"""Numbers read off the curves of fitted joints, with intervals.

A number is that of the joint with all laws that the model has there. For the interval each fitted
value is moved a little both ways and the number read off again; with the covariance of the fit that
gives the variance of the number (delta method, central differences).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinepipe.calibration.profile import NORMAL_95
from spinepipe.effects import Effect
from spinepipe.effects.contract import Array, JointLaw, PathLaw
from spinepipe.effects.field_numbers import NUMBERS, load_over, numbers_of, usual_load
from spinepipe.effects.tabulated_law import KNOTS, TabulatedLaw
from spinepipe.model import SpineModel
from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.units import (
    COORDINATE_UNITS,
    COORDINATES,
    DEG_PER_RAD,
    DISPLAY_PER_SI,
    LOAD_UNITS,
    MM_PER_M,
    TRANSLATIONS,
)

Row = dict[str, Any]

STEP = 0.05
"""Standard errors that a fitted value is moved by."""

NEARLY = 0.8
"""Share of the usual load from which tests are said to reach it."""

ONE_SIDED = 0.05
"""Share of the load that a side must have seen, for numbers to be told of it."""

_NOT_NEGATIVE = ("zone", "loop_area")

Laws = list[tuple[Effect, Array]]


def laws_at(model: SpineModel, joint: int) -> Laws:
    """Laws of a joint in all tests, with their parameters (P,), in order."""
    return [
        (one.effect, one.values[one.joints.index(joint) if one.effect.per_joint else 0])
        for one in model.effects
        if isinstance(one.effect, JointLaw | PathLaw) and joint in one.joints
        if one.tests == EVERY
    ]


@dataclass(frozen=True)
class JointNumbers:
    """Numbers (N,) of one joint of a specimen; NaN where one is not there.

    Attributes
    ----------
    slopes : (N, m) by all unknowns of the fit. at_bound : (N,) whether it hangs on one at a bound.
    """

    values: Array
    slopes: Array
    at_bound: Array


def mean_of(ones: Sequence[JointNumbers], number: int, spread: Array) -> tuple[float, float | None]:
    """Mean of a number over joints, and half its 95 % interval.

    None where the number comes and goes within the errors.

    Parameters
    ----------
    spread : (m, m) covariance of the unknowns.
    """
    value = float(np.mean([one.values[number] for one in ones]))
    slope = np.mean([one.slopes[number] for one in ones], axis=0)
    variance = float(slope @ spread @ slope)
    return value, NORMAL_95 * float(np.sqrt(variance)) if np.isfinite(variance) else None


def read_off(
    fit: JointFit,
    specimens: Sequence[str],
    joint: str,
    read: Callable[[Sequence[Laws]], list[Array]],
) -> dict[str, JointNumbers]:
    """Numbers by specimen, read off where the fit stands and beside it.

    Parameters
    ----------
    read : (N,) numbers of each of many joints, whose laws it is given. All are read at once.
    """
    errors = np.sqrt(np.diagonal(covariance(fit)))
    places: list[tuple[str, int | None, float]] = []  # specimen, unknown, how far it was moved
    curves: list[Laws] = []
    for specimen in specimens:
        member = fit.hypothesis.members[specimen]
        at = fit.models[specimen].joints.index(joint)
        own = fit.x[list(member.numbers)]
        here = laws_at(with_parameters(member.model, member.free, own), at)
        places.append((specimen, None, 0.0))
        curves.append(here)
        for place, unknown in enumerate(member.numbers):
            limits = fit.hypothesis.unknowns[unknown]
            for side in (-1.0, 1.0):
                moved = own.copy()
                to = own[place] + side * STEP * errors[unknown]
                moved[place] = np.clip(to, limits.low, limits.high)
                there = laws_at(with_parameters(member.model, member.free, moved), at)
                # a value of another joint, or one that is at its bound on this side, moves nothing
                if any(np.any(a != b) for (_, a), (_, b) in zip(here, there, strict=True)):
                    places.append((specimen, unknown, float(moved[place] - own[place])))
                    curves.append(there)
    values: dict[str, Array] = {}
    sides: dict[str, dict[int, list[tuple[float, Array]]]] = {name: {} for name in specimens}
    for (specimen, moved_one, away), numbers in zip(places, read(curves), strict=True):
        if moved_one is None:
            values[specimen] = numbers
        else:
            sides[specimen].setdefault(moved_one, []).append((away, numbers))
    return {name: _with_slopes(fit, values[name], sides[name]) for name in specimens}


def _with_slopes(
    fit: JointFit, values: Array, sides: Mapping[int, Sequence[tuple[float, Array]]]
) -> JointNumbers:
    """Central differences; one-sided ones at a bound."""
    slopes, at_bound = np.zeros((len(values), len(fit.x))), np.zeros(len(values), dtype=bool)
    for unknown, pair in sides.items():
        (low, first), (high, last) = pair if len(pair) == 2 else ((0.0, values), pair[0])
        slopes[:, unknown] = (last - first) / (high - low)
        at_bound |= fit.at_bound[unknown] & (slopes[:, unknown] != 0.0)
    return JointNumbers(values, slopes, at_bound)


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
    rows: list[Row] = []
    for model, fit in (("base", base), ("with_effects", final)):
        for (joint, coordinate), load in changed.items():
            here = [form for form in forms if form.joint in (None, joints.index(joint))]
            acting = [name for name in fit.models if any(form.acts_in(name) for form in here)]
            place = {"model": model, "joint": joint, "coordinate": coordinate, "load": load}
            rows += _of_place(place, fit, acting, tested[joint, coordinate])
    return rows


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
    # reading a curve solves for motions at loads: joints with the same laws are one stack
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
    found = read_off(fit, specimens, place["joint"], lambda laws: _read(laws, coordinate, load))
    spread = covariance(fit)
    for number, name in enumerate(NUMBERS):
        if not _seen(name, reach, load):
            continue
        there = {s: one for s, one in found.items() if np.isfinite(one.values[number])}
        groups = [(specimen, [one]) for specimen, one in there.items()]
        for specimen, ones in [*groups, *([(EVERY[0], list(there.values()))] if there else [])]:
            value, away = mean_of(ones, number, spread)
            unit, factor = unit_of(name, coordinate)  # as testers write it
            low = high = None
            if away is not None:
                low = max(value - away, 0.0) if name in _NOT_NEGATIVE else value - away
                low, high = low * factor, (value + away) * factor
            yield {
                **place,
                "specimen": specimen,
                "number": name,
                "specimens": len(ones),
                "at_bound": any(bool(one.at_bound[number]) for one in ones),
                "value": value * factor,
                "unit": unit,
                "low": low,
                "high": high,
            }


def _seen(number: str, reach: LoadRange, load: float) -> bool:
    """Whether tests loaded the side, or the sides, that a number tells of."""
    sides = (-reach.low > ONE_SIDED * load, reach.high > ONE_SIDED * load)
    if number in ("zone", "loop_area"):
        return all(sides)
    if number.endswith("_minus"):
        return sides[0]
    return sides[1] if number.endswith("_plus") or number == "drift_per_decade" else True


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


def tabulated_rows(base: JointFit, final: JointFit) -> list[Row]:
    """Each table of the final fit at each knot, joint and specimen, and the mean of specimens.

    Parameters
    ----------
    base : fit of the base model, whose load at the same motion is told beside it.
    """
    joints = next(iter(final.models.values())).joints
    rows: dict[tuple[Any, ...], Row] = {}
    for one in final.hypothesis.supposed:
        law = one.form.variant.create()
        if isinstance(law, TabulatedLaw):
            acting = [name for name in final.models if one.form.acts_in(name)]
            for joint in joints if one.form.joint is None else (joints[one.form.joint],):
                for row in _table_of_joint(base, final, acting, joint, law):
                    key = ("specimen", "joint", "coordinate", "over", "motion")
                    rows.setdefault(tuple(row[name] for name in key), row)
    return list(rows.values())


def _table_of_joint(
    base: JointFit, final: JointFit, specimens: Sequence[str], joint: str, law: TabulatedLaw
) -> Iterator[Row]:
    along = COORDINATES.index(law.along)
    motions = law.furthest * KNOTS

    def loads(joints: Sequence[Laws]) -> list[Array]:
        return [load_over(laws, law.coordinate, law.along, motions) for laws in joints]

    found = read_off(final, specimens, joint, loads)
    spread = covariance(final)
    of_each = {}
    for name in specimens:
        model = base.models[name]
        (of_each[name],) = loads([laws_at(model, model.joints.index(joint))])
    groups = [*((name, [name]) for name in specimens), (EVERY[0], list(specimens))]
    for specimen, names in groups:
        of_base = np.mean([of_each[name] for name in names], axis=0)
        for number, motion in enumerate(motions):
            value, away = mean_of([found[name] for name in names], number, spread)
            assert away is not None
            yield {
                "specimen": specimen,
                "joint": joint,
                "coordinate": law.coordinate,
                "over": law.along,
                "motion": float(motion * DISPLAY_PER_SI[along]),
                "motion_unit": COORDINATE_UNITS[law.along],
                "load": value,
                "low": value - away,
                "high": value + away,
                "base": float(of_base[number]),
                "load_unit": LOAD_UNITS[law.coordinate],
                "specimens": len(names),
            }
