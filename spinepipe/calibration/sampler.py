"""Draws from a posterior by Hamiltonian Monte Carlo, all chains' points solved together.

The chains are Mici's (trajectories of a random number of steps, Neal 2011, arXiv:1206.1901; the
step size by dual averaging, Hoffman and Gelman 2014). They move in coordinates y in which the
density is nearly round: turned as the normal density at the mode is, and each unknown that the
data tell of a function of a normal number (`_Chart`). R-hat and effective sizes are ArviZ's,
rank-normalised and split (Vehtari 2021, doi:10.1214/20-BA1221).
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from arviz_stats.base.array import array_stats
from mici.adapters import DualAveragingStepSizeAdapter
from mici.integrators import LeapfrogIntegrator
from mici.samplers import RandomMetropolisHMC
from mici.systems import EuclideanMetricSystem
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr

from spinepipe.calibration.lockstep import in_lockstep
from spinepipe.calibration.posterior import Mode, Point, Target
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

LOOKS = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0])
"""How far to either side of the mode the density is looked at, in SDs of the normal one there."""

PRIOR_LOOKS = np.array([-4.0, -3.0, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
"""And over all of the prior."""

FOLLOWED = 2.0
"""SDs up to which the other unknowns go along; further out they stay."""

FINE, KNOTS = 2001, 41
"""Points at which the density is integrated, and at which its quantiles are kept."""

OUTERMOST = 4.0
"""The last quantiles that are kept, as standard normal numbers."""

TOLD_BY_DATA = 0.9
"""Unknowns whose SD at the mode is less than this share of the prior's are made normal."""

Ask = Callable[[Array], Point | None]

logging.getLogger("mici").setLevel(logging.ERROR)  # it warns of each trajectory that leaves


@dataclass(frozen=True)
class MarkovChains:
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
        worst, least = float(self.r_hat.max()), float(np.min([self.ess_bulk, self.ess_tail]))
        told = []
        if not worst <= LARGEST_R_HAT:
            told.append(f"R-hat is {worst:.3f}, allowed {LARGEST_R_HAT:g}")
        if not least >= FEWEST_EFFECTIVE:
            told.append(f"the effective size is {least:.0f}, at least {FEWEST_EFFECTIVE:g} needed")
        return "; ".join([*told, "take more draws"]) if told else ""


def sample(
    target: Target, mode: Mode, chains: int, warm_up: int, draws: int, seed: int
) -> MarkovChains:
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
    return MarkovChains(z, accepted, target.evaluations - before)


@dataclass(frozen=True)
class _Chart:
    """Coordinates y (m,) of points z: ``t = root y``, and z a rising function of each t.

    Attributes
    ----------
    origin : (m,) of the unknowns that are only shifted, ``z = origin + t``.
    quantiles : of the others, by number.
    """

    origin: Array
    root: Array
    quantiles: Mapping[int, PchipInterpolator]

    def z(self, y: Array) -> Array:
        """(m,) of y (m,)."""
        return self._at(y)[0]

    def density(self, y: Array, point: Point) -> tuple[Array, float]:
        """Gradient (m,) by y, and value, of the energy of y at the point that it is."""
        # change of variables: energy less log det dz/dt, which is diagonal
        _, slope, bend = self._at(y)
        by_t = slope * point.gradient - bend / slope
        return self.root.T @ by_t, point.energy - float(np.sum(np.log(slope)))

    def _at(self, y: Array) -> tuple[Array, Array, Array]:
        """z (m,), and its first and second derivatives by t; straight beyond the last quantiles."""
        t = np.clip(self.root @ y, -FARTHEST, FARTHEST)
        z, slope, bend = self.origin + t, np.ones(len(t)), np.zeros(len(t))
        for unknown, rising in self.quantiles.items():
            inside = float(np.clip(t[unknown], -OUTERMOST, OUTERMOST))
            slope[unknown] = rising(inside, 1)
            z[unknown] = rising(inside) + slope[unknown] * (t[unknown] - inside)
            bend[unknown] = rising(inside, 2) if inside == t[unknown] else 0.0
        return z, slope, bend


def _chart(target: Target, mode: Mode) -> _Chart:
    """The coordinates that a mode and the density over each unknown ask for."""
    top = mode.point
    assert top is not None
    sd = np.sqrt(np.diagonal(mode.covariance))
    told = np.flatnonzero(sd < TOLD_BY_DATA).tolist()
    quantiles = {unknown: _quantiles(target, mode, unknown) for unknown in told}
    scale = np.where(sd < TOLD_BY_DATA, sd, 1.0)
    return _Chart(top.z, mode.root / scale[:, None], quantiles)


def _quantiles(target: Target, mode: Mode, unknown: int) -> PchipInterpolator:
    """An unknown as a function of standard normal numbers, as the density beside the mode has it.

    The marginal density along the unknown is estimated on a line through the mode, along which the
    others follow as in the normal density there (a profile); its distribution function P gives
    z(t) = P^-1(Phi(t)), in which the unknown is standard normal: inverse transform sampling, as a
    transport map of one unknown at a time (Parno and Marzouk 2018, doi:10.1137/17M1134640). No
    approximation enters the draws by it: it only decides in which coordinates chains move.
    """
    top = mode.point
    assert top is not None
    sd = float(np.sqrt(mode.covariance[unknown, unknown]))
    # where to look: near the mode in its SDs, and over all of the prior, which ends at 4
    far = np.concatenate([-sd * LOOKS, [0.0], sd * LOOKS, PRIOR_LOOKS - top.z[unknown]])
    away = np.unique(far[np.abs(far + top.z[unknown]) <= PRIOR_LOOKS[-1] + 1e-9])
    # the others' regression on the unknown, so far as the normal density at the mode is to be
    # believed: further out they would be led to where nothing stands
    way = mode.covariance[:, unknown] / sd**2
    points = top.z + np.clip(away, -FOLLOWED * sd, FOLLOWED * sd)[:, None] * way
    points[:, unknown] = top.z[unknown] + away
    seen = target.together([(0, point) for point in points])
    stands = np.array([one is not None for one in seen])
    energy = np.array([one.energy - top.energy for one in seen if one is not None])
    # a grid over all that stands, and a finer one about the mode, which may be narrow
    z = points[stands, unknown]
    fine = np.linspace(z[0], z[-1], FINE)
    fine = np.unique(np.concatenate([fine, np.linspace(-6, 6, FINE) * sd + top.z[unknown]]))
    fine = fine[(fine >= z[0]) & (fine <= z[-1])]
    # monotone cubics between the looks invent no peaks; where a look lies below the mode's energy,
    # as beside a mode that is not the deepest, e^5 of its density is enough to go there
    density = np.exp(-np.maximum(PchipInterpolator(z, energy)(fine), -5.0))
    share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    share /= share[-1]
    t = np.linspace(-OUTERMOST, OUTERMOST, KNOTS)
    # strictly rising, by a millionth of the SD: a map that stands still has no density
    rising = np.maximum.accumulate(np.interp(ndtr(t), share, fine))
    return PchipInterpolator(t, rising + 1e-6 * sd * t)


def _chain(
    chart: _Chart, length: tuple[int, int], rng: np.random.Generator, ask: Ask
) -> tuple[Array, float]:
    """Draws (D, m) of z of one chain, and the share of trajectories whose end was taken."""

    def slope(y: Array) -> tuple[Array, float]:
        point = ask(chart.z(y))
        # nothing stands there: of density zero, so that no trajectory ends there
        return (np.zeros_like(y), np.inf) if point is None else chart.density(y, point)

    system = EuclideanMetricSystem(
        neg_log_dens=lambda y: slope(y)[1], grad_neg_log_dens=lambda y: slope(y)
    )
    sampler = RandomMetropolisHMC(system, LeapfrogIntegrator(system), rng, STEPS)
    found = sampler.sample_chains(
        *length,
        [_start(rng, len(chart.origin), slope)],
        adapters=[DualAveragingStepSizeAdapter(ACCEPTED)],
        trace_funcs=[lambda state: {"pos": state.pos}],
        display_progress=False,
    )
    y = np.asarray(found.traces["pos"][0], dtype=float)
    accepted = np.asarray(found.statistics["accept_stat"][0], dtype=float)
    return np.array([chart.z(one) for one in y]), float(accepted.mean())


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
