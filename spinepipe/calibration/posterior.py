"""What data make likely of unknowns that a prior is known of: density, exact gradient, Laplace.

Unknowns are told as z, each standard normal before the data are seen: what it stands for is a
function of it (`Unknowns`). A number that is as likely anywhere between two bounds is
``low + (high - low) Phi(z)``. So all priors are one, an unknown of which the data say nothing is at
home at 0 with SD 1, and a density that levels off towards a bound has a mode all the same.

Of a weighted residual of coordinate c the variance is ``w_c d_c^2 + s^2``: the error of one reading
that is declared, and the scatter s that the model leaves, which the weights share out as the cost
does. Both are given. A scatter left free would find its least where landmarks explain a few
readings without residue, and be certain of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from spinepipe.calibration.problem import Evaluation, Evaluator
from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.units import DISPLAY_PER_SI

ARRIVED = 1e-3
"""A mode is reached where a Newton step would lower the energy by less: a twentieth of an SD."""

EASED, HARDENED = 0.5, 4.0
"""What damping is multiplied by after a step that went down, and after one that did not.

It is eased slowly: towards a bound Gauss and Newton see too little curvature, and step too far.
"""

MOST_STEPS = 200

DIFFERENCE = 1e-3
"""Step in z of the differences of gradients that make the curvature at a mode."""

REMEMBERED = 4096
"""Points after which an evaluator forgets those it has seen."""


class Unknowns(Protocol):
    """What standard normal numbers z (m,) stand for among the unknowns x (n,) of a problem."""

    @property
    def size(self) -> int:
        """m."""

    def at(self, numbers: Sequence[int], z: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """x (P, n), its derivative (P, n, m), and where there is any (P,).

        Parameters
        ----------
        numbers : of the search that each of the points z (P, m) belongs to.
        """


def between(low: Array, high: Array, z: Array) -> tuple[Array, Array]:
    """Numbers (..., k), uniform between bounds (k,) for standard normal z (..., k), and slopes."""
    return low + (high - low) * ndtr(z), (high - low) * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)


def normal_of(low: Array, high: Array, x: Array) -> Array:
    """z (k,) of numbers x (k,) between their bounds; a number at its bound lies far out."""
    share = np.clip((x - low) / (high - low), 1e-6, 1.0 - 1e-6)
    found: Array = ndtri(share)
    return found


@dataclass(frozen=True)
class ResidualNoise:
    """Of the weighted residuals: independent and normal.

    Attributes
    ----------
    variance : (6,) of each coordinate's, mm2 and deg2 times weight. coordinate : (N,) of each.
    """

    variance: Array
    coordinate: NDArray[np.int64]

    def seen(self, residual: Array) -> tuple[float, Array]:
        """Less the logarithm of the likelihood of residuals (N,), and their precisions (N,)."""
        variance = self.variance[self.coordinate]
        every = residual**2 / variance + np.log(2.0 * np.pi * variance)
        return 0.5 * float(every.sum()), 1.0 / variance


def noise_of(evaluator: Evaluator, sd: Array, scatter: float) -> ResidualNoise:
    """The declared error ``sd`` (6,) m and rad of one reading, and the scatter of the residuals.

    Raises
    ------
    ValueError
        Where both are zero for a coordinate that is read.
    """
    variance = evaluator.problem.weights * (DISPLAY_PER_SI * sd) ** 2 + scatter**2
    if np.any(variance[evaluator.coordinate] <= 0.0):
        raise ValueError("neither an error of readings nor a scatter of residuals is known")
    return ResidualNoise(variance, evaluator.coordinate)


@dataclass(frozen=True)
class Point:
    """The density at z (m,).

    Attributes
    ----------
    x : (n,). energy : less the logarithm of likelihood times prior, but for the prior's
        ``(2 pi)^(-m/2)``. gradient : (m,). bend : (m, m) its curvature after Gauss and Newton.
    """

    z: Array
    x: Array
    energy: float
    gradient: Array
    bend: Array
    evaluation: Evaluation


class Target:
    """The density that data and prior make; points of several searches are solved together."""

    def __init__(self, evaluator: Evaluator, unknowns: Unknowns, noise: ResidualNoise) -> None:
        """``evaluator`` : of the problem whose unknowns ``unknowns`` tell."""
        self.evaluator, self.unknowns, self.noise = evaluator, unknowns, noise
        self.evaluations = 0
        self._since = 0

    def together(self, points: Sequence[tuple[int, Array]]) -> list[Point | None]:
        """The density at z (m,) of several searches, each with its number; None where it is 0.

        It is where the priors' numbers make no model, and where the loads tip that over: the
        specimen stood.
        """
        numbers, z = [number for number, _ in points], np.array([z for _, z in points])
        x, by_z, there = self.unknowns.at(numbers, z)
        problem = self.evaluator.problem
        there &= np.all((x >= problem.lower) & (x <= problem.upper), axis=1)
        asked = np.flatnonzero(there).tolist()
        self._since += len(asked)
        self.evaluations += len(asked)
        if self._since > REMEMBERED:
            self.evaluator.forget()
            self._since = len(asked)
        result: list[Point | None] = [None] * len(points)
        if asked:
            seen = self.evaluator.together([(numbers[place], x[place]) for place in asked])
            for place, one in zip(asked, seen, strict=True):
                result[place] = self._point(z[place], x[place], by_z[place], one)
        return result

    def at(self, z: Array) -> Point | None:
        """The density at one z (m,)."""
        return self.together([(0, z)])[0]

    def _point(self, z: Array, x: Array, by_z: Array, seen: Evaluation) -> Point | None:
        if seen.residual is None or seen.jacobian is None:
            return None
        jacobian = seen.jacobian @ by_z
        unlikely, precision = self.noise.seen(seen.residual)
        gradient = jacobian.T @ (precision * seen.residual) + z
        bend = jacobian.T @ (precision[:, None] * jacobian) + np.eye(len(z))
        energy = unlikely + 0.5 * float(z @ z)
        return Point(z, x, energy, gradient, bend, seen)


@dataclass(frozen=True)
class Mode:
    """The likeliest point of one search, and the normal density that fits there.

    Attributes
    ----------
    covariance : (m, m) of z; `root` (m, m) with ``root root' = covariance``.
    log_evidence : of the data, by Laplace's approximation.
    message : why there is none; then nothing else is to be used.
    """

    point: Point | None
    covariance: Array
    root: Array
    log_evidence: float
    message: str = ""


TIPPED = "no stable equilibrium where the search begins"
NOT_LEVEL = f"no mode within {MOST_STEPS} steps"
SADDLE = "the density has no peak where the search ends"


def modes(target: Target, starts: Array) -> list[Mode]:
    """The mode that each of P searches leads to from starts (P, m), by damped Gauss-Newton."""
    size = target.unknowns.size
    steps = DIFFERENCE * np.vstack([np.eye(size), -np.eye(size)])
    found = []
    for number, (top, message) in enumerate(_climbed(target, starts)):
        curved = None
        if top is not None:
            # curvature of the energy by central differences; none beside an edge where nothing
            # stands
            around = target.together([(number, top.z + step) for step in steps])
            slopes = np.array([point.gradient for point in around if point is not None])
            if len(slopes) == len(steps):
                curved = (slopes[:size] - slopes[size:]) / (2.0 * DIFFERENCE)
                curved = 0.5 * (curved + curved.T)
        found.append(_mode(top, message, curved))
    return found


def _climbed(target: Target, starts: Array) -> list[tuple[Point | None, str]]:
    """Where each search ends, or why it does not."""
    here = target.together(list(enumerate(starts)))
    ended: list[tuple[Point | None, str]] = [
        (None, TIPPED if point is None else NOT_LEVEL) for point in here
    ]
    damping = np.full(len(starts), 1e-3)
    going = [number for number, point in enumerate(here) if point is not None]
    for _ in range(MOST_STEPS):
        trials, left = [], []
        for number in going:
            point = here[number]
            assert point is not None
            # Levenberg-Marquardt on the energy: its Gauss-Newton curvature, damped by the prior's
            damped = point.bend + damping[number] * np.eye(len(point.z))
            step = -np.linalg.solve(damped, point.gradient)
            # arrived where a step, not one cut short by damping, would gain too little
            if damping[number] <= 1.0 and -0.5 * float(step @ point.gradient) < ARRIVED:
                ended[number] = (point, "")
                continue
            left.append(number)
            trials.append((number, point.z + step))
        if not left:
            break
        for number, trial in zip(left, target.together(trials), strict=True):
            point = here[number]
            assert point is not None
            if trial is not None and trial.energy < point.energy:
                here[number] = trial
                damping[number] *= EASED
            else:
                damping[number] = max(damping[number], 1e-2) * HARDENED
        going = left
    return ended


def _mode(point: Point | None, message: str, curved: Array | None) -> Mode:
    nothing = np.zeros((0, 0))
    if point is None:
        return Mode(None, nothing, nothing, -np.inf, message)
    if curved is None:
        return Mode(None, nothing, nothing, -np.inf, TIPPED.replace("begins", "ends"))
    values, axes = eigh(curved)
    if values.min() <= 0.0:
        return Mode(None, nothing, nothing, -np.inf, SADDLE)
    # Laplace: log of the integral of exp(-energy) over a normal density, whose (2 pi)^(m/2) is the
    # prior's, so that it cancels
    root = axes / np.sqrt(values)
    evidence = -point.energy - 0.5 * float(np.sum(np.log(values)))
    return Mode(point, root @ root.T, root, evidence)
