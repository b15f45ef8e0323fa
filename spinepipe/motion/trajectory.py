"""A motion over all its time at once: the least sum of squares of markers, loads and accelerations.

Levenberg-Marquardt on the band of normal equations (`banded`), damped by the ratio of what a step
gains to what was predicted (Nielsen 1999; Madsen, Nielsen and Tingleff 2004, section 3.2). The
equations are Gauss and Newton's until a step gains little of it: loads that are left stay large,
and passive elements are exponentials of what is fitted. From then on loads count times the second
derivatives of passive elements too, as in NL2SOL (Dennis, Gay and Welsch 1981), but exactly. Trials
that share their passive elements are solved together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm

from spinepipe.effects.contract import Array
from spinepipe.motion.banded import REACH, Band, BandFactor, bordered_step
from spinepipe.motion.objective import MotionObjective, SampledTrial
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import COUNT
from spinepipe.motion.residual_terms import Markers, MuscleDemand, range_excess
from spinepipe.motion.skeleton import JOINTS
from spinepipe.status import Status

MOST_STEPS = 200
SMALL = 1e-3
"""What an undamped step may still be predicted to gain.

A cost is a sum of squares over SD: no number that is asked for is then farther than the root of
this, 0.03 of its own SD, from where the model costs least (Bates and Watts 1981 stop likewise).
"""

POOR = 0.25
"""Share of the predicted gain below which a model is a poor one (Dennis and Schnabel 1983)."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-9, 1e9
"""Shares of the diagonal: of the first step, the least, and where the search gives up."""

_FOUND = "the least cost is found"
_MOST_EASED = 0.1
"""Of the damping, after a step as good as predicted; Nielsen's third takes twice the steps down."""


@dataclass(frozen=True, eq=False)
class OptimalMotions:
    """Motions that cost least.

    Attributes
    ----------
    coefficients : (N + 3, 18, 6) of each trial. parameters : (P,) logarithms of the sizes and then
        of the shapes of fitted passive elements, over the generic ones. law : with these.
    cost : of all trials together, with the prior of the parameters.
    """

    status: Status
    message: str
    coefficients: tuple[Array, ...]
    parameters: Array
    law: PassiveLaw | None
    cost: float
    steps: int


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Coefficients of each trial, and the parameters that all share."""

    coefficients: tuple[Array, ...]
    parameters: Array

    def plus(self, steps: Sequence[Array], shared: Array) -> "_Iterate":
        places = (
            one + step.reshape(one.shape)
            for one, step in zip(self.coefficients, steps, strict=True)
        )
        return _Iterate(tuple(places), self.parameters + shared)


def law_of(ask: MotionObjective, parameters: Array) -> PassiveLaw | None:
    """The generic passive elements with fitted sizes and shapes."""
    if ask.passive is None or not len(parameters):
        return ask.passive
    scales = np.ones((2, len(JOINTS), 6))
    for scale, logs in zip(scales, np.split(parameters, 2), strict=True):
        scale[ask.fitted] = np.exp(logs)
    return ask.passive.scaled(*scales)


def solve(
    ask: MotionObjective,
    trials: Sequence[SampledTrial],
    starts: Sequence[Array],
    parameters: Array | None = None,
    held: Array | None = None,
) -> OptimalMotions:
    """From coefficients (N + 3, 18, 6) of each trial.

    Parameters
    ----------
    parameters : (P,) to begin with. held : (P,) which of them stay.
    """
    problem = Trajectory(ask, tuple(trials), held)
    shared = np.zeros(ask.parameters) if parameters is None else parameters
    state = _Iterate(tuple(np.where(ask.free, one, 0.0) for one in starts), shared)
    found = _MotionSearch(state, problem.cost(state), _FIRST_DAMPING)
    steps, begun = 0, np.inf
    while steps < MOST_STEPS and not found.ended:
        steps += 1
        found = _take_step(problem, found)
        if found.ended == _FOUND and begun - found.cost > SMALL:
            # begun again at its answer it has to stay: Gauss and Newton's longer steps lead out of
            # hollows in which second derivatives hold it
            begun = found.cost
            found = _MotionSearch(found.state, found.cost, _FIRST_DAMPING)
    done = found.ended == _FOUND
    return OptimalMotions(
        Status.CONVERGED if done else Status.NOT_CONVERGED,
        "" if done else found.ended or f"still falling after {steps} steps",
        found.state.coefficients,
        found.state.parameters,
        law_of(ask, found.state.parameters),
        found.cost,
        steps,
    )


@dataclass(frozen=True, eq=False)
class _StepEquations:
    """Equations of a step about a state.

    Attributes
    ----------
    scales, scale : diagonals of Gauss and Newton's equations, which damping is a share of: (C, n)
        of each band and (P,); those with second derivatives may be negative.
    """

    bands: list[Band]
    square: Array
    slope: Array
    scales: list[Array]
    scale: Array


@dataclass(frozen=True, eq=False)
class _MotionSearch:
    """Where a search is, and how it goes on.

    Attributes
    ----------
    newton : whether second derivatives of passive elements count. ended : why it goes no further;
        empty if it does.
    """

    state: _Iterate
    cost: float
    damping: float
    newton: bool = False
    ended: str = ""


def _take_step(problem: "Trajectory", now: _MotionSearch) -> _MotionSearch:
    """One step downhill, damped as much as it takes; or the end.

    Or no step, where Gauss and Newton's equations have led uphill or end, and second derivatives
    are to count from now on.
    """
    equations = problem.normal(now.state, now.newton)
    # without loads on passive elements there are no second derivatives that could be missing
    exact = now.newton or problem.ask.passive is None or not problem.ask.loads
    damping, growth, looked, lost = now.damping, 2.0, False, ""
    while damping < _MOST_DAMPING:
        try:
            move, shared, gain = problem.step(equations, damping)
        except LinAlgError:
            damping, growth = damping * growth, 2.0 * growth
            lost = "the equations of a step are not definite"
            continue
        lost = "no step lowers the cost, though its slope says that one would"
        # little is left to gain: second derivatives decide, then the undamped step, looked at once
        if gain < SMALL and not exact:
            return replace(now, newton=True)
        if gain < SMALL and not looked:
            looked = True
            if (least := _end_at_least(problem, now, equations)) is not None:
                return least
        there = now.state.plus(move, shared)
        found = problem.cost(there)
        ratio = (now.cost - found) / gain if np.isfinite(found) else -1.0
        newton = now.newton or (not exact and ratio < POOR)
        # Nielsen's rule: damping falls with the cube of how good the model was, and grows by
        # doubled factors where the step was uphill
        if ratio > 0.0:
            eased = max(_MOST_EASED, 1.0 - (2.0 * ratio - 1.0) ** 3)
            return _MotionSearch(there, found, max(eased * damping, _LEAST_DAMPING), newton)
        if newton and not now.newton:
            return replace(now, newton=True)
        damping, growth = damping * growth, 2.0 * growth
    return replace(now, ended=lost)


def _end_at_least(
    problem: "Trajectory", now: _MotionSearch, equations: _StepEquations
) -> _MotionSearch | None:
    """The end of a search, if an undamped step is predicted to gain nearly nothing.

    It is taken if it gains at all. Equations that are not definite are those of no least cost.
    """
    try:
        move, shared, gain = problem.step(equations, 0.0)
    except LinAlgError:
        return None
    if gain >= SMALL:
        return None
    there = now.state.plus(move, shared)
    found = problem.cost(there)
    if found < now.cost:
        return replace(now, state=there, cost=found, ended=_FOUND)
    return replace(now, ended=_FOUND)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Costs of motions, and their normal equations."""

    ask: MotionObjective
    trials: tuple[SampledTrial, ...]
    held: Array | None = None

    def cost(self, state: _Iterate) -> float:
        """Sum of squares of markers, loads, accelerations, ranges and the prior at a state."""
        ask, law, sums = self.ask, law_of(self.ask, state.parameters), np.zeros(4)
        for trial, coefficients in zip(self.trials, state.coefficients, strict=True):
            motion, none = trial.grid.at_nodes(coefficients), np.zeros(1)
            loads = MuscleDemand.of(trial, ask)
            parts = (
                Markers(trial, ask).residuals(motion[0]),
                loads.residuals(law, motion) if ask.loads else none,
                motion[2] / ask.sizes.of_accelerations if ask.smooth else none,
                range_excess(ask, motion[0])[0],
            )
            sums += np.array([float(np.sum(part**2)) for part in parts]) * self._worth(trial)
        prior = float(np.sum((state.parameters / self._prior) ** 2))
        markers, loads_cost, accelerations, over = sums.tolist()
        return float(markers + loads_cost + accelerations + over + prior)

    def _worth(self, trial: SampledTrial) -> float:
        """Of one node: all together are worth so many frames."""
        return self.ask.sizes.frames / (trial.grid.intervals + 1)

    @property
    def _prior(self) -> Array:
        """(P,) SD of the logarithms."""
        half = self.ask.parameters // 2
        return np.repeat([self.ask.sizes.size, self.ask.sizes.shape], half)

    def normal(self, state: _Iterate, newton: bool = False) -> _StepEquations:
        """Equations of a step about a state; newton : with second derivatives."""
        law, count = law_of(self.ask, state.parameters), self.ask.parameters
        square = np.diag(1.0 / self._prior**2) if count else np.zeros((0, 0))
        slope = state.parameters / self._prior**2 if count else np.zeros(0)
        bands, scales, scale = [], [], square.diagonal()
        for trial, coefficients in zip(self.trials, state.coefficients, strict=True):
            band, own_square, own_slope, active = self._band(trial, coefficients, law)
            scales.append(band.diagonal.copy())
            scale = scale + own_square.diagonal()
            if newton and law is not None:
                self._add_second_derivatives(band, own_square, trial, coefficients, law, active)
            bands.append(band)
            square, slope = square + own_square, slope + own_slope
        if self.held is not None:
            # what is held hangs together with nothing and is not asked to move
            held = np.flatnonzero(self.held)
            for band in bands:
                band.border[..., held] = 0.0
            square[held], square[:, held], slope[held] = 0.0, 0.0, 0.0
            square[held, held] = 1.0
        return _StepEquations(bands, square, slope, scales, scale)

    @property
    def _free(self) -> NDArray[np.int64]:
        """(n,) coordinates that there are, of all 108."""
        return np.flatnonzero(self.ask.free)

    def _band(
        self, trial: SampledTrial, coefficients: Array, law: PassiveLaw | None
    ) -> tuple[Band, Array, Array, Array]:
        """With the square and slope of what is shared, and loads (N + 1, 102) over their sizes."""
        shared, worth, free = self.ask.parameters, self._worth(trial), self._free
        band = Band.empty(trial.grid.coefficients, shared, len(free))
        motion, weights = trial.grid.at_nodes(coefficients), trial.grid.weights
        self._add_markers_and_ranges(band, trial, motion[0])
        if self.ask.smooth:
            self._add_accelerations(band, trial, motion[2])
        square, slope = np.zeros((shared, shared)), np.zeros(shared)
        if not self.ask.loads:
            return band, square, slope, np.zeros((0, 0))
        loads, fitted = MuscleDemand.of(trial, self.ask), np.flatnonzero(self.ask.fitted)
        own, left = [], []
        for k, node in enumerate(loads.by_node(law, motion, weights)):
            # block pentadiagonal band: a node's slopes by its three coefficients, each times each;
            # the band is kept row by row, which to BLAS is the transposed block in place
            each, weighed = node.each, node.weighed
            if len(free) < COUNT:
                each, weighed = each[..., free], weighed[..., free]
            band.slope[k : k + REACH] += worth * (node.active @ weighed)
            for j in range(REACH):
                for i in range(j, REACH):
                    block = band.blocks[k + j, i - j].T
                    dgemm(worth, each[j].T, weighed[i].T, 1.0, block, trans_b=1, overwrite_c=1)
            if shared:
                # a passive element moves its own load alone, whose metric meets all others
                by = np.append(node.by_size[fitted], node.by_shape[fitted])
                twice = np.concatenate([weighed[:, fitted]] * 2, axis=1)
                band.border[k : k + REACH] += worth * np.swapaxes(by[:, None] * twice, 1, 2)
                own.append(by)
            left.append(node.active)
        active = np.array(left)
        if shared:
            by = np.array(own)
            rows = loads.metric[np.tile(fitted, 2)]
            square = worth * rows[:, np.tile(fitted, 2)] * (by.T @ by)
            slope = worth * (by * (active @ rows.T)).sum(axis=0)
        return band, square, slope, active

    def _add_second_derivatives(
        self,
        band: Band,
        square: Array,
        trial: SampledTrial,
        coefficients: Array,
        law: PassiveLaw,
        active: Array,
    ) -> None:
        """Loads that are left, times second derivatives of passive elements."""
        free, curve, nodes = self._free, trial.grid.weights[0], len(active)
        pull = self._worth(trial) * MuscleDemand.of(trial, self.ask).pulls(active)
        q = trial.grid.at_nodes(coefficients)[0][:, 1:]
        force, stiffness, by_shape, bends, by_both, by_shapes = (
            one.reshape(nodes, -1) * pull for one in (*law.with_slopes(q), *law.curvatures(q))
        )
        # of each coordinate by itself: a node's place is that share of its three coefficients
        turned = np.zeros((nodes, COUNT))
        turned[:, COUNT - bends.shape[1] :] = bends
        diagonal = np.arange(len(free))
        for j in range(REACH):
            for i in range(j, REACH):
                share = curve[i] * curve[j] * turned[:, free]
                band.blocks[j : j + nodes, i - j, diagonal, diagonal] += share
        # of each fitted element: by its coordinate and its two logarithms, and by these
        fitted = np.flatnonzero(self.ask.fitted)
        at = np.searchsorted(free, fitted + COUNT - bends.shape[1])
        size, shape = np.arange(len(fitted)), len(fitted) + np.arange(len(fitted))
        for j, share in enumerate(curve):
            band.border[j : j + nodes, at, size] += share * stiffness[:, fitted]
            band.border[j : j + nodes, at, shape] += share * by_both[:, fitted]
        square[size, size] += force[:, fitted].sum(axis=0)
        square[shape, shape] += by_shapes[:, fitted].sum(axis=0)
        for one, other in ((size, shape), (shape, size)):
            square[one, other] += by_shape[:, fitted].sum(axis=0)

    def _add_markers_and_ranges(self, band: Band, trial: SampledTrial, q: Array) -> None:
        """Markers and ranges: what hangs on places alone."""
        free, curve, worth = self._free, trial.grid.weights[0], self._worth(trial)
        off, slopes = Markers(trial, self.ask).with_slopes(q)
        over, steep = (one.reshape(len(q), COUNT)[:, free] for one in range_excess(self.ask, q))
        diagonal = np.arange(len(free))
        for k, here in enumerate(slopes if len(free) == COUNT else slopes[..., free]):
            square = here.T @ here
            square[diagonal, diagonal] += steep[k] ** 2
            down = off[k] @ here + over[k] * steep[k]
            band.slope[k : k + REACH] += worth * curve[:, None] * down
            for j in range(REACH):
                for i in range(j, REACH):
                    band.blocks[k + j, i - j] += worth * curve[i] * curve[j] * square

    def _add_accelerations(self, band: Band, trial: SampledTrial, acceleration: Array) -> None:
        """Accelerations: each coordinate's own three coefficients."""
        free, frames = self._free, len(acceleration)
        sizes = np.tile(self.ask.sizes.of_accelerations, COUNT // 6)[free]
        share = self._worth(trial) / sizes**2
        curve = trial.grid.weights[2]
        flat = acceleration.reshape(frames, COUNT)[:, free] * share
        diagonal = np.arange(len(free))
        for i, first in enumerate(curve):
            band.slope[i : i + frames] += first * flat
            for j, second in enumerate(curve[: i + 1]):
                band.blocks[j : j + frames, i - j, diagonal, diagonal] += first * second * share

    def step(self, equations: _StepEquations, damping: float) -> tuple[list[Array], Array, float]:
        """Damped step (C, 108) of each trial's coefficients, and of the parameters; the gain that
        is predicted.
        """
        # every diagonal gets a little besides: what nothing asks about stays where it is
        factors = [
            BandFactor.of(band, damping * scale + 1e-9 * float(scale.max()))
            for band, scale in zip(equations.bands, equations.scales, strict=True)
        ]
        square = equations.square + damping * np.diag(equations.scale)
        found, shared = bordered_step(equations.bands, factors, square, equations.slope)
        # gain of the damped model: step (damping scale step - slope) over all unknowns
        gain = float(damping * equations.scale @ shared**2 - equations.slope @ shared)
        steps = [np.zeros((len(one), COUNT)) for one in found]
        each = zip(steps, found, equations.bands, equations.scales, strict=True)
        for step, one, band, scale in each:
            gain += float(np.sum((damping * scale * one - band.slope) * one))
            step[:, self._free] = one
        return steps, shared, gain
