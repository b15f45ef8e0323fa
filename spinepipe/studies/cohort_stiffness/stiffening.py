"""Joint laws that stiffen: on each fitted coordinate resistance grows as the joint moves.

The law is ``k sign(q) (exp(b |q|) - 1) / b``, stiffness k at rest and growth b, of the effect
`nonlinear_stiffening` on the bushing; a growth of 0 is the linear bushing. Fits start there, so
that what no reading tells of stays linear.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration import Fit, Pooled, Problem
from spinepipe.calibration.fit import names_at_bound
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, free_parameters, with_parameters
from spinepipe.status import Status, joined
from spinepipe.studies.cohort_stiffness.representations import STIFFENING_EFFECT, named
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import GROWTH_CELLS, SPREAD_CELLS
from spinepipe.units import COORDINATES

Row = dict[str, Any]

FIRST = 1
"""Place of the first of these effects in a model: the bushing they scale is before them."""

AT_BOUND = {-1: "lower", 0: "no", 1: "upper"}


@dataclass(frozen=True)
class Growth:
    """What a fit, or others, say of the growth of each joint and coordinate.

    Attributes
    ----------
    values : (J, 6) in 1/rad and 1/m, NaN where none was found.
    standard_error, low, high : (J, 6), NaN where there is none.
    open_below, open_above : (J, 6) bool; None where no region was looked for. Open below: the data
        do not exclude a linear joint.
    identifiable : (J, 6) bool; None where it was not fitted. at_bound : (J, 6).
    """

    values: Array
    standard_error: Array
    low: Array
    high: Array
    open_below: NDArray[np.bool_] | None
    open_above: NDArray[np.bool_] | None
    identifiable: NDArray[np.bool_] | None
    at_bound: NDArray[np.int64]

    @classmethod
    def of(cls, values: Array) -> "Growth":
        """Values (J, 6) of which nothing else is known, to be filled in."""
        error, low, high = (np.full(values.shape, np.nan) for _ in range(3))
        return cls(values, error, low, high, None, None, None, np.zeros(values.shape, dtype=int))

    def row(self, at: tuple[int, int]) -> Row:
        """Cells of table ``stiffness``."""
        flags = (self.open_below, self.open_above, self.identifiable)
        below, above, known = (None if one is None else bool(one[at]) for one in flags)
        (parameter,) = create(STIFFENING_EFFECT, {"coordinate": COORDINATES[at[1]]}).parameters
        return {
            "growth": _number(self.values[at]),
            "growth_unit": parameter.unit,
            "growth_standard_error": _number(self.standard_error[at]),
            "growth_low": _number(self.low[at]),
            "growth_high": _number(self.high[at]),
            "growth_open_below": below,
            "growth_open_above": above,
            "growth_identifiable": known,
            "growth_at_bound": AT_BOUND[int(self.at_bound[at])],
        }


LINEAR: Row = dict.fromkeys(GROWTH_CELLS)
"""Cells of a representation that does not stiffen."""


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def laws(study: CohortStiffness, growth: Array | None) -> tuple[ScopedEffect, ...]:
    """One effect per fitted coordinate with growth (J, 6); none for a linear representation."""
    if growth is None:
        return ()
    joints = tuple(range(len(growth)))
    return tuple(
        ScopedEffect(
            create(STIFFENING_EFFECT, {"coordinate": name}),
            joints,
            growth[:, [COORDINATES.index(name)]].copy(),
        )
        for name in study.free
    )


def free_growth(
    study: CohortStiffness, model: SpineModel, representation: str
) -> tuple[FreeParameter, ...]:
    """Unknowns of the laws of a model that was made with them; none where it does not stiffen."""
    one = named(representation)
    if not one.stiffens:
        return ()
    assert one.grouping is not None  # nothing of a published set is fitted
    found: tuple[FreeParameter, ...] = ()
    for number, name in enumerate(study.free):
        (parameter,) = model.effects[FIRST + number].effect.parameters
        unknowns = free_parameters(model, FIRST + number, [parameter.name], one.grouping)
        for unknown in unknowns:  # with the coordinate: the effect is there once for each
            _, at, joint = unknown.label.partition("@")
            found += (replace(unknown, label=f"growth in {name}{at}{joint}"),)
    return found


def place_of(study: CohortStiffness, unknown: FreeParameter) -> tuple[list[int], int] | None:
    """Joints and coordinate of which an unknown is the growth; None where it is a stiffness."""
    if unknown.effect < FIRST:
        return None
    return list(unknown.rows), COORDINATES.index(study.free[unknown.effect - FIRST])


def fitted_growth(study: CohortStiffness, problem: Problem, found: Fit) -> Growth | None:
    """What a fit says of growth; None where it is linear."""
    places = [place_of(study, unknown) for unknown in problem.free]
    if not any(places):
        return None
    shape = len(problem.model.joints), len(COORDINATES)
    values, error, low, high = (np.full(shape, np.nan) for _ in range(4))
    open_below, open_above, known = (np.full(shape, fill) for fill in (True, True, False))
    at_bound = np.zeros(shape, dtype=int)
    model = with_parameters(problem.model, problem.free, found.x)
    region = found.profile
    for index, (unknown, at) in enumerate(zip(problem.free, places, strict=True)):
        if at is None:
            continue
        fitted = model.effects[unknown.effect].values[list(unknown.rows), unknown.column]
        values[at] = np.maximum(fitted, 0.0)
        standard_error = found.uncertainty.standard_error[index]
        error[at] = standard_error if np.isfinite(standard_error) else np.nan
        at_bound[at] = found.at_bound[index]
        if region is not None:
            open_below[at], open_above[at] = region.open_below[index], region.open_above[index]
            # A region that is open below reaches down to the linear joint.
            low[at] = 0.0 if region.open_below[index] else region.low[index]
            high[at] = np.nan if region.open_above[index] else region.high[index]
            known[at] = found.uncertainty.identifiable[index] and region.closed[index]
    return Growth(values, error, low, high, open_below, open_above, known, at_bound)


def status_with_growth(
    problem: Problem, at_bound: NDArray[Any], status: Status, message: str
) -> tuple[Status, str]:
    """Status and message of a fit: growth that ended at zero is linear, and at no bound.

    Parameters
    ----------
    at_bound : (m,) as in `Fit`. message : of the fit, which begins with what is at a bound.
    """
    sides = zip(problem.free, at_bound, strict=True)
    none = [unknown.effect >= FIRST and side < 0 for unknown, side in sides]
    if status is not Status.CONVERGED_AT_BOUND or not any(none):
        return status, message
    # The message begins with the names of all that is at a bound: told anew without these.
    left = np.where(none, 0, at_bound)
    rest = message.removeprefix(names_at_bound(problem, at_bound)).removeprefix("; ")
    ending = Status.CONVERGED_AT_BOUND if left.any() else Status.CONVERGED
    linear = f"linear: {sum(none)} of {sum(u.effect >= FIRST for u in problem.free)} growths are 0"
    return ending, joined(names_at_bound(problem, left), linear, rest)


def pooled_status(problems: Sequence[Problem], found: Pooled) -> Pooled:
    """A pooled fit with each specimen's `status_with_growth`, and so that of the whole."""
    specimens = []
    for problem, one in zip(problems, found.specimens, strict=True):
        status, message = status_with_growth(problem, one.at_bound, one.status, one.message)
        specimens.append(replace(one, status=status, message=message))
    status = found.status
    standing = {one.status for one in specimens if one.poses}
    if status is Status.CONVERGED_AT_BOUND and status not in standing:
        status = Status.CONVERGED
    return replace(found, specimens=tuple(specimens), status=status)


@dataclass(frozen=True)
class PooledUnknowns:
    """What a pooled fit says of the m unknowns of one specimen.

    Attributes
    ----------
    x, variance : (m,) moves from the start. at_bound : (m,).
    decided : (m,) whether the specimen's own readings do; None of a newcomer.
    """

    free: tuple[FreeParameter, ...]
    x: Array
    variance: Array
    at_bound: NDArray[Any]
    decided: NDArray[np.bool_] | None


def pooled_growth(
    study: CohortStiffness, told: PooledUnknowns, joints: int, reach: float
) -> Growth | None:
    """What a pool says of growth; None where it is linear.

    Parameters
    ----------
    reach : ends of the intervals in standard errors, cut off at zero; infinite for none.
    """
    growth = Growth.of(np.full((joints, len(COORDINATES)), np.nan))
    known = np.zeros(growth.values.shape, dtype=bool)
    for index, unknown in enumerate(told.free):
        at = place_of(study, unknown)
        if at is None:
            continue
        value, error = told.x[index], np.sqrt(told.variance[index])
        growth.values[at] = max(value, 0.0)  # a pool may draw it below: the linear joint
        growth.at_bound[at] = told.at_bound[index]
        growth.standard_error[at] = error
        growth.low[at], growth.high[at] = np.maximum(value + error * np.array([-reach, reach]), 0.0)
        known[at] = told.decided is not None and told.decided[index]
    if not any(unknown.effect for unknown in told.free):
        return None
    return growth if told.decided is None else replace(growth, identifiable=known)


def growth_spread(study: CohortStiffness, found: Pooled, coordinate: str) -> Row:
    """Cells of table ``pooling`` of the growth in a coordinate; none of a linear fit."""
    place = FIRST + study.free.index(coordinate)
    spreads = [spread for spread in found.spreads if spread.effect == place]
    if not spreads:
        return {}
    (one,) = spreads
    told = (max(one.mean, 0.0), one.level or None, one.specimen or None, one.rest)
    return dict(zip(SPREAD_CELLS, told, strict=True))


def median_growth(
    study: CohortStiffness, joints: Sequence[str], representation: str, median: Any
) -> Array | None:
    """(J, 6) growth of rows with ``joint``, ``coordinate`` and ``growth``; None where linear."""
    if not named(representation).stiffens:
        return None
    growth = np.zeros((len(joints), len(COORDINATES)))
    places = [joints.index(joint) for joint in median["joint"]]
    growth[places, [COORDINATES.index(name) for name in median["coordinate"]]] = median["growth"]
    return growth
