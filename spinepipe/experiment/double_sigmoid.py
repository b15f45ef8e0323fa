"""The neutral zone of a curve from one side to the other, by summed sigmoids.

Source: Smit, van Tunen, van der Veen, Kingma and van Dieen 2011, BMC Musculoskeletal Disorders 12,
38, doi:10.1186/1471-2474-12-38. Rotation over load is fitted by

    y = c1 / (1 + exp(-(a1 + b1 x))) + c2 / (1 + exp(-(a2 + b2 x))) + d.

Its first derivative is the compliance; the neutral zone lies between the largest and the least
second derivative, where compliance rises and falls fastest. Of one sigmoid alone, c1, it is from
a + b x = -1.317 to 1.317, and c1 / sqrt(3) wide.

Beyond the source: a straight line is kept where one sigmoid is no better, and one sigmoid where two
are no better. Two of them follow noise gladly, and then bend where the joint does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import brentq
from scipy.special import expit

from spinepipe.decomposition import bounded_least_squares, lstsq, svd
from spinepipe.experiment.loop import Measure

Array = NDArray[np.float64]

FEWEST_POINTS = 10
"""Three more than the unknowns of two sigmoids: with fewer the curve follows the noise."""

SIGNIFICANCE = 0.05
"""More unknowns are believed where fewer would leave so much by chance at most so often."""

_HARDLY = 0.001
"""Chance by which noise leaves so much that a curve does not describe the points."""

_FAR, _LARGEST = 60.0, 60.0
"""Bounds of |a| and |d|, and of c, with the largest load and the range of rotation as units."""

_SHALLOWEST = 0.05
"""Least b, in the same units: a sigmoid that is flatter is a straight line within the loads."""

_STEPS_PER_RISE = 3.0
"""A sigmoid takes at least so many steps of load from 12 to 88 % of its rise, which is 4 / b."""

_ONE = ((0.0, 2.0), (0.0, 6.0))
_TWO = ((-0.4, 4.0, 0.4, 4.0), (0.0, 6.0, 0.0, 1.5), (-0.3, 8.0, 0.3, 2.0), (-0.3, 2.0, 0.3, 8.0))
"""Middle and steepness of each sigmoid where fits start."""

_GRID = 801
"""Places where extremes of the second derivative are looked for before they are refined."""

_RANK = 1e-7
"""Singular values below this share of the largest are of unknowns that no point tells of."""

_STEP = 1e-5
"""Of central differences; also where derivatives of an order that has no formula are taken."""

_ROUNDING = 1e-9
"""A line that leaves less than this share of the range of rotation leaves nothing."""


class Zone(StrEnum):
    """Whether a neutral zone was found."""

    FOUND = "found"
    NOT_DESCRIBED = "not_described"
    NOT_MEANINGFUL = "not_meaningful"
    TOO_FEW = "too_few"
    ONE_SIDE = "one_side"
    ONE_WAY = "one_way"
    NOT_READ = "not_read"


@dataclass(frozen=True)
class FittedNeutralZone:
    """Where a joint resists least.

    Attributes
    ----------
    size : rad between the ends. compliance : rad/(N m), size over the load between them.
    ends : N m, loads where it begins and ends.
    """

    size: Measure
    compliance: Measure
    ends: tuple[float, float]


@dataclass(frozen=True)
class SigmoidCurve:
    """A fitted curve, in units of the largest load and of the range of rotation.

    Attributes
    ----------
    theta : (4,) or (7,) a, b, c of each sigmoid, then d. gain : (m, N) their derivative by the
        rotations (rad). ends : least and largest load. squares : rad2, what the curve leaves.
    """

    theta: Array
    gain: Array
    load_unit: float
    rotation_unit: float
    ends: tuple[float, float]
    squares: float

    def rotation(self, load: Array) -> Array:
        """rad at loads (N m)."""
        return self.rotation_unit * _value(self.theta, np.asarray(load) / self.load_unit)


def neutral_zone(
    load: Array, rotation: Array, sd: float | None, below: float | None = None
) -> tuple[FittedNeutralZone | None, Zone, str]:
    """The neutral zone of a curve of N points, or why there is none, in a word and in words.

    Parameters
    ----------
    load : (N,) N m. rotation : (N,) rad, whose weights the measures have.
    sd : rad, of one reading; None takes the noise from what the curve leaves.
    below : N m/rad, stiffness that the zone is softer than; None: it is between the bends.
    """
    loads = _distinct(load)
    if loads < FEWEST_POINTS:
        why = f"{loads} loads from side to side; a neutral zone takes {FEWEST_POINTS}"
        return None, Zone.TOO_FEW, why
    if not np.ptp(rotation) or load @ (rotation - rotation.mean()) <= 0.0:
        return None, Zone.NOT_MEANINGFUL, "the joint does not move with the load"
    curve = fit_sigmoids(load, rotation, sd)
    if curve is None:
        why = "no neutral zone: an S-shaped curve fits no better than a straight line"
        return None, Zone.NOT_MEANINGFUL, why
    level = None if below is None else curve.load_unit / (curve.rotation_unit * below)
    places = _zone(curve) if level is None else _softer(curve, level)
    if places is None:
        why = "no neutral zone: compliance does not rise and fall between the largest loads"
        if level is not None:
            why = "no neutral zone: softer than the threshold nowhere, or up to the largest loads"
        return None, Zone.NOT_MEANINGFUL, why
    # Where noise does not explain what the curve leaves, its bends are not the joint's: a zone
    # narrower than the steps of load bends faster than any sigmoid that they allow.
    freedom = len(load) - len(curve.theta)
    if sd is not None and curve.squares / sd**2 > float(stats.chi2.isf(_HARDLY, freedom)):
        left = float(np.sqrt(curve.squares / len(load)))
        why = (
            f"softer in the middle, but sigmoids leave {np.rad2deg(left):.2g} deg where readings "
            f"are noisy by {np.rad2deg(sd):.2g}: no neutral zone from these loads, read more"
        )
        return None, Zone.NOT_DESCRIBED, why
    return _measured(curve, places, level), Zone.FOUND, ""


def _distinct(load: Array) -> int:
    """How many loads there are that differ by a hundredth of their range."""
    steps = np.diff(np.sort(load))
    return 1 + int(np.count_nonzero(steps > 0.01 * np.ptp(load)))


def fit_sigmoids(load: Array, rotation: Array, sd: float | None) -> SigmoidCurve | None:
    """The sum of as few sigmoids as the points ask for; None where a straight line does as well.

    Parameters
    ----------
    load, rotation : (N,) N m and rad, not all the same. sd : see `neutral_zone`.
    """
    load_unit, rotation_unit = float(np.abs(load).max()), float(np.ptp(rotation))
    x, y = load / load_unit, rotation / rotation_unit
    noise = None if sd is None else sd / rotation_unit
    line = np.column_stack([np.ones(len(x)), x])
    left = y - line @ lstsq(line, y)[0]
    theta, squares = None, float(left @ left)
    if squares <= len(x) * _ROUNDING**2:
        return None
    # Forward selection of nested models: a line, one sigmoid, two, as long as each is better.
    for starts in (_ONE, _TWO):
        fewer, more = 2 if theta is None else len(theta), 3 * len(starts[0]) // 2 + 1
        if not _better(squares, 0.0, fewer, more, len(x), noise):
            break  # not even a curve through all points would be
        found, less = min((_descend(x, y, start) for start in starts), key=lambda one: one[1])
        if not _better(squares, less, fewer, more, len(x), noise):
            break
        theta, squares = found, less
    if theta is None:
        return None
    gain = _gain(theta, x) / rotation_unit
    ends = float(load.min()), float(load.max())
    return SigmoidCurve(theta, gain, load_unit, rotation_unit, ends, squares * rotation_unit**2)


def _better(
    squares: float, less: float, fewer: int, more: int, points: int, noise: float | None
) -> bool:
    """Whether more unknowns leave less by more than chance: chi-square of known noise, else F."""
    if noise is not None:
        return (squares - less) / noise**2 > float(stats.chi2.isf(SIGNIFICANCE, more - fewer))
    left = max(less, points * _ROUNDING**2) / (points - more)
    limit = float(stats.f.isf(SIGNIFICANCE, more - fewer, points - more))
    return (squares - less) / (more - fewer) / left > limit


def _bounds(count: int, x: Array) -> tuple[Array, Array]:
    """Least and largest unknowns of so many sigmoids."""
    step = np.ptp(x) / (_distinct(x) - 1)
    steepest = 4.0 / (_STEPS_PER_RISE * step)
    low = [-_FAR, _SHALLOWEST, 0.0] * count
    high = [_FAR, steepest, _LARGEST] * count
    return np.array([*low, -_FAR]), np.array([*high, _FAR])


def _descend(x: Array, y: Array, start: Sequence[float]) -> tuple[Array, float]:
    """Unknowns and sum of squares where a start leads to."""
    # A start names the middle and the steepness b of each sigmoid, so that a = -middle b; together
    # they rise by 1.2 times the range of rotation, of which the loads show a part.
    pairs = [start[at : at + 2] for at in range(0, len(start), 2)]
    low, high = _bounds(len(pairs), x)
    theta = [one for middle, steep in pairs for one in (-middle * steep, steep, 1.2 / len(pairs))]
    found = bounded_least_squares(
        lambda t: _value(t, x) - y,
        np.clip([*theta, float(y.min())], low, high),
        lambda t: _jacobian(t, x),
        (low, high),
        xtol=1e-8,
        ftol=1e-9,
        gtol=1e-10,
        max_nfev=60,
    )
    return np.asarray(found.x), 2.0 * float(found.cost)


def _sigmoids(theta: Array) -> Array:
    """(n, 3) a, b, c of each."""
    return theta[:-1].reshape(-1, 3)


def _value(theta: Array, x: Array, order: int = 0) -> Array:
    """(N,) the curve at x, or its derivative by x of an order up to 3."""
    total = np.full(np.shape(x), theta[-1] if order == 0 else 0.0)
    for a, b, c in _sigmoids(theta):
        s = expit(a + b * x)
        slope = s * (1.0 - s)
        # derivatives of the logistic function by its argument, the chain rule makes b ** order
        by_order = (s, slope, slope * (1.0 - 2.0 * s), slope * (1.0 - 6.0 * slope))
        total = total + c * b**order * by_order[order]
    return total


def _jacobian(theta: Array, x: Array) -> Array:
    """(N, m) derivative of the curve by its unknowns."""
    columns = []
    for a, b, c in _sigmoids(theta):
        s = expit(a + b * x)
        slope = c * s * (1.0 - s)
        columns += [slope, slope * x, s]
    return np.column_stack([*columns, np.ones(len(x))])


def _gain(theta: Array, x: Array) -> Array:
    """(m, N) derivative of the unknowns by the points, to first order; those at a bound stay."""
    low, high = _bounds(len(_sigmoids(theta)), x)
    inside = (theta > low + 1e-9) & (theta < high - 1e-9)
    # Least squares to first order: the pseudoinverse of the Jacobian.
    left, sizes, right = svd(_jacobian(theta, x)[:, inside])
    seen = sizes > _RANK * sizes.max(initial=0.0)
    gain = np.zeros((len(theta), len(x)))
    gain[inside] = (right[seen].T / sizes[seen]) @ left[:, seen].T
    return gain


def _zone(curve: SigmoidCurve) -> Array | None:
    """(2,) where the second derivative is largest and least, both inside the ends, in this order.

    None where there is no such pair: the curve is not S-shaped between the ends.
    """
    low, high = (end / curve.load_unit for end in curve.ends)
    x = np.linspace(low, high, _GRID)
    second = _value(curve.theta, x, 2)
    at = int(np.argmax(second)), int(np.argmin(second))
    if at[0] >= at[1] or at[0] == 0 or at[1] == len(x) - 1:
        return None
    # The third derivative changes its sign there, from + to - at the largest, back at the least:
    # only then is there a root to refine between the neighbours on the grid.
    third = _value(curve.theta, x, 3)
    if third[at[0] - 1] <= 0.0 or third[at[1] - 1] >= 0.0:
        return None
    if third[at[0] + 1] >= 0.0 or third[at[1] + 1] <= 0.0:
        return None

    def slope(place: float) -> float:
        return float(_value(curve.theta, np.asarray(place), 3))

    return np.array([brentq(slope, x[one - 1], x[one + 1]) for one in at])


def _softer(curve: SigmoidCurve, level: float) -> Array | None:
    """(2,) ends, about the place of largest compliance, of where compliance is above a level.

    None where it is so nowhere, or as far as an end.
    """
    low, high = (end / curve.load_unit for end in curve.ends)
    x = np.linspace(low, high, _GRID)

    def above(place: float) -> float:
        return float(_value(curve.theta, np.asarray(place), 1)) - level

    compliance = _value(curve.theta, x, 1)
    most, stiff = int(np.argmax(compliance)), np.flatnonzero(compliance <= level)
    left, right = stiff[stiff < most], stiff[stiff > most]
    if compliance[most] <= level or not len(left) or not len(right):
        return None
    return np.array([brentq(above, x[at], x[at + 1]) for at in (left[-1], right[0] - 1)])


def _measured(curve: SigmoidCurve, places: Array, level: float | None) -> FittedNeutralZone:
    """Size and compliance with their weights, to first order."""
    # ends are roots: of the third derivative, or of the first less the level
    order, root = (3, 0.0) if level is None else (1, level)
    ahead, behind = (_value(curve.theta, places + step, order) for step in (_STEP, -_STEP))
    slope = (ahead - behind) / (2.0 * _STEP)

    def both(theta: Array) -> Array:
        # Newton, exact to first order
        there = places - (_value(theta, places, order) - root) / slope
        low, high = _value(theta, there)
        size = curve.rotation_unit * (high - low)
        return np.array([size, size / (curve.load_unit * (there[1] - there[0]))])

    # Chain rule: size and compliance by the unknowns, and these by the points.
    steps = _STEP * np.maximum(np.abs(curve.theta), 0.1)
    slopes = [
        (both(curve.theta + move) - both(curve.theta - move)) / (2.0 * step)
        for move, step in zip(np.diag(steps), steps, strict=True)
    ]
    of_size, of_compliance = np.transpose(slopes) @ curve.gain
    size, compliance = both(curve.theta)
    low, high = curve.load_unit * places
    return FittedNeutralZone(
        Measure(float(size), of_size),
        Measure(float(compliance), of_compliance),
        (float(low), float(high)),
    )
