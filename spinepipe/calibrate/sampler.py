"""Draws from a posterior by Hamiltonian Monte Carlo, all chains' points solved together.

The chains are Mici's (trajectories of a random number of steps, Neal 2011, arXiv:1206.1901; the
step size by dual averaging, Hoffman and Gelman 2014). They move in coordinates y in which the
density is nearly round: as the normal density at the mode is, and where it falls faster to one
side than to the other, skewed as Tukey's g is (`_Chart`). R-hat and effective sizes are ArviZ's,
rank-normalised and split (Vehtari 2021, doi:10.1214/20-BA1221).
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from arviz_stats.base.array import array_stats
from mici.adapters import DualAveragingStepSizeAdapter
from mici.integrators import LeapfrogIntegrator
from mici.samplers import RandomMetropolisHMC
from mici.states import ChainState
from mici.systems import EuclideanMetricSystem

from spinepipe.calibrate.lockstep import in_lockstep
from spinepipe.calibrate.posterior import Mode, Point, Target
from spinepipe.effects.contract import Array

LARGEST_R_HAT = 1.01
FEWEST_EFFECTIVE = 400.0
"""Vehtari 2021: what chains must reach before their numbers are believed."""

STEPS = (1, 5)
"""A trajectory has one step, or more, of less than so many: about a quarter of a turn.

A trajectory that doubles until it turns back (no-U-turn) needs three times as many for draws that
are no freer: in these coordinates it is known how long a turn is.
"""

ACCEPTED = 0.7
"""Share of trajectories whose end is to be taken; the step size is fitted to it."""

FARTHEST = 30.0
"""A point of a trajectory that runs away is held so far out: nothing is likely there."""

WIDE = 2.0
"""Chains begin so many SDs of the normal density at the mode away from it, per axis."""

MOST_HALVINGS = 8
"""Of a chain's start towards the mode, where nothing stands so far out."""

_ARVIZ: Any = array_stats  # it has no types
_AXES = {"chain_axis": 0, "draw_axis": 1}

FALL = 1.0
"""Of the logarithm of the density, at which its two sides are compared."""

LOOKS = np.array([0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0])
"""How far from the mode that fall is looked for, in SDs of the normal density there."""

TOLD_BY_DATA = 0.9
"""Unknowns whose SD at the mode is less than this share of the prior's may be skewed."""

LEAST_SKEW = 1e-6

Ask = Callable[[Array], Point | None]

logging.getLogger("mici").setLevel(logging.ERROR)  # it warns of each trajectory that leaves


@dataclass(frozen=True)
class Chains:
    """Draws of C chains.

    Attributes
    ----------
    z : (C, D, m). accepted : share of trajectories whose end was taken.
    evaluations : points that were solved for them.
    """

    z: Array
    accepted: float
    evaluations: int


@dataclass(frozen=True)
class Convergence:
    """Of quantities (q,): R-hat, and the effective sizes of their bulk and of their tails."""

    r_hat: Array
    ess_bulk: Array
    ess_tail: Array

    @property
    def message(self) -> str:
        """Why the draws are not to be believed; "" where they are."""
        worst, least = float(self.r_hat.max()), float(min(self.ess_bulk.min(), self.ess_tail.min()))
        told = []
        if not worst <= LARGEST_R_HAT:
            told.append(f"R-hat is {worst:.3f}, allowed {LARGEST_R_HAT:g}")
        if not least >= FEWEST_EFFECTIVE:
            told.append(f"the effective size is {least:.0f}, at least {FEWEST_EFFECTIVE:g} needed")
        return "; ".join([*told, "take more draws"]) if told else ""


def sample(target: Target, mode: Mode, chains: int, warm_up: int, draws: int, seed: int) -> Chains:
    """Draws around a mode that has been found.

    Parameters
    ----------
    warm_up : steps per chain that fit the step size and are thrown away.
    """
    assert mode.point is not None
    before = target.evaluations
    chart = _chart(target, mode)
    seeds = np.random.SeedSequence(seed).spawn(chains)
    runs = [partial(_chain, chart, (warm_up, draws), np.random.default_rng(one)) for one in seeds]
    ended = in_lockstep(runs, target.together)
    z = np.stack([one for one, _ in ended])
    accepted = float(np.mean([share for _, share in ended]))
    return Chains(z, accepted, target.evaluations - before)


@dataclass(frozen=True)
class _Chart:
    """Coordinates y (m,): ``z = mode + width (exp(skew t) - 1) / skew`` with ``t = root y``.

    Attributes
    ----------
    root : (m, m), of the normal density at the mode in units of ``width`` (m,).
    """

    mode: Array
    width: Array
    skew: Array
    root: Array

    def z(self, y: Array) -> Array:
        """(m,) of y (m,)."""
        t = self._straight(y)
        level = np.abs(self.skew) < LEAST_SKEW
        skew = np.where(level, 1.0, self.skew)
        found: Array = self.mode + self.width * np.where(level, t, np.expm1(skew * t) / skew)
        return np.clip(found, -FARTHEST, FARTHEST)

    def _straight(self, y: Array) -> Array:
        found: Array = np.clip(self.root @ y, -FARTHEST, FARTHEST)
        return found

    def density(self, y: Array, point: Point) -> tuple[Array, float]:
        """Gradient (m,) by y, and value, of the energy of y at the point that it is."""
        t = self._straight(y)
        by_t = self.width * np.exp(self.skew * t) * point.gradient - self.skew
        return self.root.T @ by_t, point.energy - float(self.skew @ t)


def _chart(target: Target, mode: Mode) -> _Chart:
    """The coordinates that a mode and what lies to both sides of it ask for."""
    top = mode.point
    assert top is not None
    sd = np.sqrt(np.diagonal(mode.covariance))
    width, skew = np.ones(len(sd)), np.zeros(len(sd))
    for unknown in np.flatnonzero(sd < TOLD_BY_DATA):
        way = mode.covariance[:, unknown] / sd[unknown]
        sides = [_reach(target, top, side * way) for side in (-1.0, 1.0)]
        bent = np.log(sides[1] / sides[0]) / np.sqrt(2.0 * FALL)
        width[unknown], skew[unknown] = sd[unknown], np.clip(bent, -1.0, 1.0)
    return _Chart(top.z, width, skew, mode.root / width[:, None])


def _reach(target: Target, top: Point, way: Array) -> float:
    """How many times one must go that way from the top for the density to have fallen by `FALL`."""
    seen = target.together([(0, top.z + look * way) for look in LOOKS])
    falls = np.array([np.inf if one is None else one.energy - top.energy for one in seen])
    beyond = np.flatnonzero(falls >= FALL)
    if not len(beyond):
        return float(LOOKS[-1])
    after = int(beyond[0])
    near, low = (LOOKS[after - 1], max(falls[after - 1], 0.0)) if after else (0.0, 0.0)
    if not np.isfinite(falls[after]):
        return float(0.5 * (near + LOOKS[after]))
    share = (np.sqrt(FALL) - np.sqrt(low)) / (np.sqrt(falls[after]) - np.sqrt(low))
    return float(near + share * (LOOKS[after] - near))


def _chain(
    chart: _Chart, length: tuple[int, int], rng: np.random.Generator, ask: Ask
) -> tuple[Array, float]:
    """Draws (D, m) of z of one chain, and the share of trajectories whose end was taken."""

    def slope(y: Array) -> tuple[Array, float]:
        point = ask(chart.z(y))
        return (np.zeros_like(y), np.inf) if point is None else chart.density(y, point)

    system = EuclideanMetricSystem(
        neg_log_dens=lambda y: slope(y)[1], grad_neg_log_dens=lambda y: slope(y)
    )
    sampler = RandomMetropolisHMC(system, LeapfrogIntegrator(system), rng, STEPS)
    found = sampler.sample_chains(
        *length,
        [_start(rng, len(chart.mode), slope)],
        adapters=[DualAveragingStepSizeAdapter(ACCEPTED)],
        trace_funcs=[_position],
        display_progress=False,
    )
    y = np.asarray(found.traces["pos"][0], dtype=float)
    accepted = np.asarray(found.statistics["accept_stat"][0], dtype=float)
    return np.array([chart.z(one) for one in y]), float(accepted.mean())


def _position(state: ChainState) -> dict[str, Array]:
    return {"pos": state.pos}


def _start(
    rng: np.random.Generator, size: int, slope: Callable[[Array], tuple[Array, float]]
) -> Array:
    """Where a chain begins: wide around the mode, and where the spine stands."""
    y: Array = WIDE * rng.standard_normal(size)
    for _ in range(MOST_HALVINGS):
        if np.isfinite(slope(y)[1]):
            return y
        y = y / 2.0
    return np.zeros(size)


def convergence(values: Sequence[Array]) -> Convergence:
    """Of quantities whose draws are (C, D) each; one that does not vary has converged."""
    rows = []
    for value in values:
        if np.ptp(value) == 0.0:
            rows.append((1.0, float(value.size), float(value.size)))
            continue
        r_hat = _ARVIZ.rhat(value, **_AXES)
        bulk = _ARVIZ.ess(value, method="bulk", **_AXES)
        tail = _ARVIZ.ess(value, method="tail", prob=(0.05, 0.95), **_AXES)
        rows.append((float(r_hat), float(bulk), float(tail)))
    return Convergence(*np.array(rows).T)
