"""A motion over all its time at once: the least sum of squares of markers, loads and accelerations.

Levenberg-Marquardt on the band of normal equations (`banded`); trials that share their passive
elements are solved together.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.linalg import LinAlgError

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
        return _Asked(bands, square, slope)

    def _band(
        self, trial: Watched, coefficients: Array, law: PassiveLaw | None
    ) -> tuple[Band, Array, Array]:
        count, worth = self.ask.parameters, self._worth(trial)
        band = Band.empty(trial.grid.coefficients, count)
        motion, weights = trial.grid.at_nodes(coefficients), trial.grid.weights
        squares, slopes = self._by_place(trial, motion)
        frames, places = len(squares), weights[0]
        square, slope = np.zeros((count, count)), np.zeros(count)
        if self.ask.loads:
            off, by_motion, shared = Loads.of(trial, self.ask).with_slopes(law, motion)
            # (F, 3, 108, R): what each of a node's three coefficients does to its loads
            each = np.swapaxes(
                (weights.T @ by_motion.reshape(frames, REACH, -1)).reshape(by_motion.shape), 2, 3
            )
            flat = shared.reshape(off.size, count)
            square += worth * (flat.T @ flat)
            slope += worth * (flat.T @ off.ravel())
        for i in range(REACH):
            down = places[i] * slopes
            if self.ask.loads:
                down += (each[:, i] @ off[..., None])[..., 0]
                band.border[i : i + frames] += worth * (each[:, i] @ shared)
            band.slope[i : i + frames] += worth * down
            for j in range(i + 1):
                block = places[i] * places[j] * squares
                if self.ask.loads:
                    block += each[:, i] @ np.swapaxes(each[:, j], 1, 2)
                band.blocks[j : j + frames, i - j] += worth * block
        self._smoothed(band, trial, motion[2], worth)
        self._locked(band)
        return band, square, slope

    def _by_place(self, trial: Watched, motion: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """(F, 108, 108) and (F, 108) of markers and ranges."""
        off, slopes = Markers(trial, self.ask).with_slopes(motion[0])
        turned = np.swapaxes(slopes, 1, 2)
        squares = turned @ slopes
        down = np.einsum("fqr,fr->fq", turned, off)
        over, steep = (one.reshape(len(off), COUNT) for one in beyond(self.ask, motion[0]))
        diagonal = np.arange(COUNT)
        squares[:, diagonal, diagonal] += steep**2
        return squares, down + over * steep

    def _smoothed(self, band: Band, trial: Watched, acceleration: Array, worth: float) -> None:
        """Accelerations: each coordinate's own three coefficients."""
        if not self.ask.smooth:
            return
        share = worth / np.tile(self.ask.sizes.of_accelerations, COUNT // 6) ** 2
        curve = trial.grid.weights[2]
        frames = len(acceleration)
        flat = acceleration.reshape(frames, COUNT) * share
        diagonal = np.arange(COUNT)
        for i, first in enumerate(curve):
            band.slope[i : i + frames] += first * flat
            for j, second in enumerate(curve[: i + 1]):
                band.blocks[j : j + frames, i - j, diagonal, diagonal] += first * second * share

    def _locked(self, band: Band) -> None:
        """Coordinates that are not there neither move nor are asked to."""
        locked = np.flatnonzero(~self.ask.free.reshape(COUNT))
        band.slope[:, locked] = 0.0
        band.border[:, locked] = 0.0
        band.blocks[:, :, locked] = 0.0
        band.blocks[..., locked] = 0.0
        band.diagonal[:, locked] = 1.0

    def step(self, asked: _Asked, damping: float) -> tuple[list[Array], Array]:
        """Damped step of all coefficients and parameters."""
        # every diagonal gets a little besides: what nothing asks about stays where it is
        factors = [
            Factor.of(band, damping, 1e-9 * float(band.diagonal.max())) for band in asked.bands
        ]
        square = asked.square + damping * np.diag(np.diag(asked.square))
        loose = np.ones(len(square), dtype=bool) if self.held is None else ~self.held.astype(bool)
        bands = [replace(band, border=band.border[..., loose]) for band in asked.bands]
        shared = np.zeros(len(square))
        steps, shared[loose] = bordered_step(
            bands, factors, square[np.ix_(loose, loose)], asked.slope[loose]
        )
        return steps, shared
