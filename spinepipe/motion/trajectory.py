"""A motion over all its time at once: the least sum of squares of markers, loads and accelerations.

Levenberg-Marquardt on the band of normal equations (`banded`); trials that share their passive
elements are solved together.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm

from spinepipe.effects.contract import Array
from spinepipe.motion.asked import Ask, Watched
from spinepipe.motion.banded import REACH, Band, Factor, bordered_step
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import COUNT
from spinepipe.motion.skeleton import JOINTS
from spinepipe.motion.terms import Loads, Markers, beyond
from spinepipe.status import Status

MOST_STEPS = 80
SMALL = 1e-4
"""Share of the cost by which a last step changes it."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-9, 1e9


@dataclass(frozen=True)
class Costs:
    """Parts of the cost, of all trials."""

    markers: float
    loads: float
    accelerations: float
    beyond: float
    prior: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.markers + self.loads + self.accelerations + self.beyond + self.prior


@dataclass(frozen=True, eq=False)
class Solved:
    """Motions that cost least.

    Attributes
    ----------
    coefficients : (N + 3, 18, 6) of each trial. parameters : (P,) logarithms of the sizes and then
        of the shapes of fitted passive elements, over the generic ones. law : with these.
    """

    status: Status
    message: str
    coefficients: tuple[Array, ...]
    parameters: Array
    law: PassiveLaw | None
    costs: Costs
    steps: int


@dataclass(frozen=True, eq=False)
class _State:
    coefficients: tuple[Array, ...]
    parameters: Array

    def moved(self, steps: Sequence[Array], shared: Array) -> "_State":
        places = (
            one + step.reshape(one.shape)
            for one, step in zip(self.coefficients, steps, strict=True)
        )
        return _State(tuple(places), self.parameters + shared)


def law_of(ask: Ask, parameters: Array) -> PassiveLaw | None:
    """The generic passive elements with fitted sizes and shapes."""
    if ask.passive is None or not len(parameters):
        return ask.passive
    scales = np.ones((2, len(JOINTS), 6))
    for scale, logs in zip(scales, np.split(parameters, 2), strict=True):
        scale[ask.fitted] = np.exp(logs)
    return ask.passive.scaled(*scales)


def solve(
    ask: Ask,
    trials: Sequence[Watched],
    starts: Sequence[Array],
    parameters: Array | None = None,
    held: Array | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Solved:
    """From coefficients (N + 3, 18, 6) of each trial.

    Parameters
    ----------
    parameters : (P,) to begin with. held : (P,) which of them stay.
    """
    problem = Trajectory(ask, tuple(trials), held)
    shared = np.zeros(ask.parameters) if parameters is None else parameters
    state = _State(tuple(np.where(ask.free, one, 0.0) for one in starts), shared)
    costs, damping, steps, lost = problem.costs(state), _FIRST_DAMPING, 0, ""
    while steps < MOST_STEPS:
        steps += 1
        asked = problem.normal(state)
        before = costs.total
        state, costs, damping, lost = _stepped(problem, state, costs, asked, damping)
        say(f"step {steps}, cost {costs.total:.5g}")
        if lost or before - costs.total < SMALL * costs.total:
            break
    done = steps < MOST_STEPS and not lost
    return Solved(
        Status.CONVERGED if done else Status.NOT_CONVERGED,
        lost or ("" if done else f"still falling after {steps} steps"),
        state.coefficients,
        state.parameters,
        law_of(ask, state.parameters),
        costs,
        steps,
    )


@dataclass(frozen=True, eq=False)
class _Asked:
    """Normal equations about a state."""

    bands: list[Band]
    square: Array
    slope: Array


def _stepped(
    problem: "Trajectory", state: _State, costs: Costs, asked: _Asked, damping: float
) -> tuple[_State, Costs, float, str]:
    """One step downhill, damped as much as it takes; the last text says why there is none.

    Where all steps lead uphill the cost is at its least, up to rounding, and there is no text.
    """
    lost = ""
    while damping < _MOST_DAMPING:
        try:
            steps, shared = problem.step(asked, damping)
        except LinAlgError:
            damping, lost = 10.0 * damping, "the equations of a step are not definite"
            continue
        lost = ""
        there = state.moved(steps, shared)
        found = problem.costs(there)
        if np.isfinite(found.total) and found.total <= costs.total:
            eased = max(0.2 * damping, _LEAST_DAMPING)
            return there, found, eased, ""
        damping *= 5.0
    return state, costs, damping, lost


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Costs of motions, and their normal equations."""

    ask: Ask
    trials: tuple[Watched, ...]
    held: Array | None = None

    def costs(self, state: _State) -> Costs:
        """Of a state."""
        law, sums = law_of(self.ask, state.parameters), np.zeros(4)
        for trial, coefficients in zip(self.trials, state.coefficients, strict=True):
            sums += self._of_trial(trial, coefficients, law)
        prior = float(np.sum((state.parameters / self._prior) ** 2))
        markers, loads, accelerations, over = sums.tolist()
        return Costs(markers, loads, accelerations, over, prior)

    def _of_trial(self, trial: Watched, coefficients: Array, law: PassiveLaw | None) -> Array:
        motion = trial.grid.at_nodes(coefficients)
        parts = [Markers(trial, self.ask).residuals(motion[0])]
        loads = Loads.of(trial, self.ask)
        parts.append(loads.residuals(law, motion) if self.ask.loads else np.zeros(1))
        smooth = motion[2] / self.ask.sizes.of_accelerations
        parts.append(smooth if self.ask.smooth else np.zeros(1))
        parts.append(beyond(self.ask, motion[0])[0])
        return np.array([float(np.sum(part**2)) for part in parts]) * self._worth(trial)

    def _worth(self, trial: Watched) -> float:
        """Of one node: all together are worth so many frames."""
        return self.ask.sizes.frames / (trial.grid.intervals + 1)

    @property
    def _prior(self) -> Array:
        """(P,) SD of the logarithms."""
        half = self.ask.parameters // 2
        return np.repeat([self.ask.sizes.size, self.ask.sizes.shape], half)

    def normal(self, state: _State) -> _Asked:
        """Normal equations about a state."""
        law, count = law_of(self.ask, state.parameters), self.ask.parameters
        square = np.diag(1.0 / self._prior**2) if count else np.zeros((0, 0))
        slope = state.parameters / self._prior**2 if count else np.zeros(0)
        bands = []
        for trial, coefficients in zip(self.trials, state.coefficients, strict=True):
            band, own_square, own_slope = self._band(trial, coefficients, law)
            bands.append(band)
            square, slope = square + own_square, slope + own_slope
        if self.held is not None:
            # what is held hangs together with nothing and is not asked to move
            held = np.flatnonzero(self.held)
            for band in bands:
                band.border[..., held] = 0.0
            square[held], square[:, held], slope[held] = 0.0, 0.0, 0.0
            square[held, held] = 1.0
        return _Asked(bands, square, slope)

    @property
    def _free(self) -> NDArray[np.int64]:
        """(n,) coordinates that there are, of all 108."""
        return np.flatnonzero(self.ask.free)

    def _band(
        self, trial: Watched, coefficients: Array, law: PassiveLaw | None
    ) -> tuple[Band, Array, Array]:
        shared, worth, free = self.ask.parameters, self._worth(trial), self._free
        band = Band.empty(trial.grid.coefficients, shared, len(free))
        motion, weights = trial.grid.at_nodes(coefficients), trial.grid.weights
        self._placed(band, trial, motion[0])
        self._smoothed(band, trial, motion[2])
        square, slope = np.zeros((shared, shared)), np.zeros(shared)
        if not self.ask.loads:
            return band, square, slope
        loads, fitted = Loads.of(trial, self.ask), np.flatnonzero(self.ask.fitted)
        own = []
        for k, node in enumerate(loads.by_node(law, motion, weights)):
            each, weighed = node.each, node.weighed
            if len(free) < COUNT:
                each, weighed = each[..., free], weighed[..., free]
            band.slope[k : k + REACH] += worth * (node.active @ weighed)
            for j in range(REACH):
                for i in range(j, REACH):
                    block = band.blocks[k + j, i - j].T
                    dgemm(worth, each[j].T, weighed[i].T, 1.0, block, trans_b=1, overwrite_c=1)
            if shared:
                by = np.append(node.by_size[fitted], node.by_shape[fitted])
                twice = np.concatenate([weighed[:, fitted]] * 2, axis=1)
                band.border[k : k + REACH] += worth * np.swapaxes(by[:, None] * twice, 1, 2)
                own.append((by, node.active))
        if shared:
            by, active = (np.array(one) for one in zip(*own, strict=True))
            rows = loads.metric[np.tile(fitted, 2)]
            square = worth * rows[:, np.tile(fitted, 2)] * (by.T @ by)
            slope = worth * (by * (active @ rows.T)).sum(axis=0)
        return band, square, slope

    def _placed(self, band: Band, trial: Watched, q: Array) -> None:
        """Markers and ranges: what hangs on places alone."""
        free, curve, worth = self._free, trial.grid.weights[0], self._worth(trial)
        off, slopes = Markers(trial, self.ask).with_slopes(q)
        over, steep = (one.reshape(len(q), COUNT)[:, free] for one in beyond(self.ask, q))
        diagonal = np.arange(len(free))
        for k, here in enumerate(slopes if len(free) == COUNT else slopes[..., free]):
            square = here.T @ here
            square[diagonal, diagonal] += steep[k] ** 2
            down = off[k] @ here + over[k] * steep[k]
            band.slope[k : k + REACH] += worth * curve[:, None] * down
            for j in range(REACH):
                for i in range(j, REACH):
                    band.blocks[k + j, i - j] += worth * curve[i] * curve[j] * square

    def _smoothed(self, band: Band, trial: Watched, acceleration: Array) -> None:
        """Accelerations: each coordinate's own three coefficients."""
        if not self.ask.smooth:
            return
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

    def step(self, asked: _Asked, damping: float) -> tuple[list[Array], Array]:
        """Damped step (C, 108) of each trial's coefficients, and of the parameters."""
        # every diagonal gets a little besides: what nothing asks about stays where it is
        factors = [
            Factor.of(band, damping, 1e-9 * float(band.diagonal.max())) for band in asked.bands
        ]
        square = asked.square + damping * np.diag(np.diag(asked.square))
        found, shared = bordered_step(asked.bands, factors, square, asked.slope)
        steps = [np.zeros((len(one), COUNT)) for one in found]
        for step, one in zip(steps, found, strict=True):
            step[:, self._free] = one
        return steps, shared
