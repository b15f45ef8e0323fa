"""How far a value of a missing effect may go while all else that is fitted makes up for it.

A profile likelihood (`calibrate.profile`): the value is held, everything else is fitted anew
through the simulator and keeps its weak priors. Its own prior is taken off, or a typical size
written down beforehand would close what no reading does. Imperfections are part of the whitened
noise, where they make up for it as well.
"""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.calibration.descent import DescentTolerances, Point, descend, once
from spinepipe.calibration.profile import NORMAL_95, Best, RegionEnds, profile_in_turn
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.joint_fit import SETTLED, JointFit, Points, Setting
from spinepipe.studies.discrepancy.search.model_files import FittedValue, fitted_values, in_tables

KNOWN = 0.02
"""Share of the rise allowed to which chi2 is known where the others have been fitted anew."""

MOST_LOOKS = 8
"""Points that one such fit looks at."""

AHEAD = 1.01
"""First looks go so much beyond where a straight problem would end, and mostly are the last."""

FARTHEST = 200.0
"""Prior SDs from the value (of a strength: a thousand as declared); beyond no number is told."""

PULLED = 0.05
"""SDs by which its own prior may have drawn a value away, for the fit to be taken as it is."""

SOFTEST = 1e-3
"""Share of a fitted stiffness of contact, below which there is none."""

OPEN = RegionEnds(None, None, True, True)


@dataclass(frozen=True)
class ValueWithRegion(FittedValue):
    """A fitted value with its region.

    Attributes
    ----------
    low, high : 95 % region by profile likelihood, in the value's unit; None where it is open.
    open_below, open_above : the readings allow the bound there, and what may lie beyond.
    """

    low: float | None
    high: float | None
    open_below: bool
    open_above: bool

    @property
    def identifiable(self) -> bool:
        """Whether both ends are known; else the readings do not tell the value."""
        return not (self.open_below or self.open_above)


def values_with_regions(
    fit: JointFit, setting: Setting, number: int
) -> tuple[ValueWithRegion, ...]:
    """All fitted values of one supposed effect with their regions.

    Parameters
    ----------
    setting : that of the fit.
    """
    own = [k for k, u in enumerate(fit.hypothesis.unknowns) if u.supposed == number]
    found = []
    for unknown, value in zip(own, fitted_values(fit, number), strict=True):
        reach = region(fit, setting, unknown)
        low, high = (
            None if end is None else in_tables(fit, unknown, end)[0]
            for end in (reach.low, reach.high)
        )
        found.append(ValueWithRegion(**vars(value), **(vars(reach) | {"low": low, "high": high})))
    return tuple(found)


def region(fit: JointFit, setting: Setting, unknown: int) -> RegionEnds:
    """Ends of one unknown, as moves from where the fit started; the value lies within."""
    if not fit.usable:
        return OPEN
    points = Points(fit.hypothesis, setting, fit.poses)
    points.begin_at(fit)
    ruler = _ruler(fit, unknown)
    point = once(_without_own_prior(points, unknown, ruler))
    best = _likeliest(fit, point, unknown, ruler)
    if best is None:
        return OPEN
    seen = profile_in_turn(best, point, [unknown])
    if seen.lower_cost:
        return OPEN
    below, above = bool(seen.open_below[unknown]), bool(seen.open_above[unknown])
    value = float(fit.x[unknown])
    return RegionEnds(
        None if below else min(ruler.move(float(seen.low[unknown])), value),
        None if above else max(ruler.move(float(seen.high[unknown])), value),
        below,
        above,
    )


@dataclass(frozen=True)
class _Ruler:
    """What an unknown is moved in: itself, or the logarithm of what it is from ``zero`` on.

    The stiffness of a contact may grow to that of a wall and hardly be seen to.
    """

    zero: float | None = None

    def move(self, mark: float) -> float:
        """The unknown."""
        return mark if self.zero is None else self.zero + float(np.exp(mark))

    def mark(self, move: float) -> float:
        """Where on the ruler the unknown is."""
        return move if self.zero is None else float(np.log(move - self.zero))

    def slope(self, mark: float) -> float:
        """Of the unknown, along the ruler."""
        return 1.0 if self.zero is None else float(np.exp(mark))

    def limits(self, move: float, low: float, high: float) -> tuple[float, float]:
        """Bounds of the unknown on the ruler."""
        if self.zero is not None:
            low = max(low, self.zero + SOFTEST * (move - self.zero))
        return self.mark(low), self.mark(high)


def _ruler(fit: JointFit, unknown: int) -> _Ruler:
    own = fit.hypothesis.unknowns[unknown]
    assert own.supposed is not None
    supposed = fit.hypothesis.supposed[own.supposed]
    p = supposed.form.variant.create().parameters[own.column]
    zero = -float(supposed.start[own.column])
    grows = p.unit in STIFFNESSES and not p.logarithmic and p.low == 0.0
    return _Ruler(zero) if grows and fit.x[unknown] > zero else _Ruler()


STIFFNESSES = ("N/m", "N m/rad")


def _without_own_prior(points: Points, unknown: int, ruler: _Ruler) -> Point:
    """Errors in their SDs, and priors of all other unknowns; the unknown is on its ruler."""

    def point(y: Array) -> tuple[Array, Array] | None:
        x = y.copy()
        x[unknown] = ruler.move(float(y[unknown]))
        found = points.compressed(x)
        if found is None:
            return None
        residual, jacobian = found[0].copy(), found[1].copy()
        row = unknown - len(x)  # priors come last, a row each
        residual[row], jacobian[row] = 0.0, 0.0
        jacobian[:, unknown] *= ruler.slope(float(y[unknown]))
        return residual, jacobian

    return point


def _likeliest(fit: JointFit, point: Point, unknown: int, ruler: _Ruler) -> Best | None:
    """Where the readings would have the unknown; None where that is not found."""
    unknowns, x = fit.hypothesis.unknowns, fit.x.copy()
    own, scale, at = unknowns[unknown], np.array([u.step for u in unknowns]), float(x[unknown])
    lower, upper = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
    reach = max(own.low, at - FARTHEST * own.sd), min(own.high, at + FARTHEST * own.sd)
    x[unknown] = ruler.mark(at)
    lower[unknown], upper[unknown] = ruler.limits(at, *reach)
    slope = ruler.slope(float(x[unknown]))
    scale[unknown] /= slope  # as long a step on the ruler
    found = point(x)
    if found is None:
        return None
    straight = np.zeros(len(x), dtype=bool)  # none is looked for along one over it
    begun = Best(x, *found, lower, upper, scale, straight, _enough(found[0]), True, AHEAD)
    pull = slope * abs(at - own.mean) / own.sd**2  # of its own prior, which the readings withstood
    if pull <= PULLED * begun.told_by(unknown) and not (fit.at_bound[unknown] or fit.status):
        return begun
    ended = descend(point, x, (lower, upper), scale, len(found[0]), SETTLED)
    found = point(ended.x)
    if found is None or not ended.arrived:
        return None
    return replace(begun, x=ended.x, residual=found[0], jacobian=found[1])


def _enough(residual: Array) -> DescentTolerances:
    """When the others have been fitted well enough beside the noise."""
    cost = KNOWN * NORMAL_95**2 / max(float(residual @ residual), 1.0)
    return DescentTolerances(cost, step=1e-4, slope=1e-10, evaluations=MOST_LOOKS)
