"""Which equilibrium a load leads to: Newton, a certificate of its step, else the load in halves.

The pose of a load step is the end of the path of stable equilibria along which the loads come on as
stated: steps in order, in proportion within a step, from the neutral pose. Where stability is lost
on the way (a fork, a limit point) the step is `unstable`, however large the steps are.

- *Newton* with the exact tangent, from the pose of the step before. Where a step leads to more work
  than half of what was gained it is cut back to where the work along it is least: loads grow along
  every direction, and steps over a corner (friction, a stop) arrive.
- *Certificate.* The tangent is linear in the load, so a step is a piece of the path if the tangent
  is positive at its start under the load after it, at its end under the load before it, and in
  between: looked at where the step is long, or Newton's first step told little of it.
- *Halves.* A step that is not certified is halved, until stability is seen to be lost.

The LU factors of a tangent serve the step, the determinant and the sensitivities.

Stability is decided by the linearised damped motion M x'' + C x' + K x = 0. K is not symmetric
under a constant moment, so its symmetric part alone decides nothing. Cheap sufficient tests come
first; the 2n eigenvalues are computed only when these leave a doubt.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf

from spinepipe.effects.contract import Array, Indices, straight_over
from spinepipe.statics.joint_forces import States
from spinepipe.statics.system import Loading, System
from spinepipe.status import Status
from spinepipe.units import COORDINATES
from spinepipe.world import Chain


class SingularTangent(ArithmeticError):
    """The tangent has no inverse at this pose."""


@dataclass(frozen=True)
class LUFactors:
    """LU factors of K (n, n); `sign` of its determinant."""

    lu: Array
    pivots: Array
    sign: int

    def solve(self, right: Array, transposed: bool = False) -> Array:
        """K^-1 times (n,) or (n, m), or that of K'."""
        solution, _ = dgetrs(self.lu, self.pivots, right, trans=int(transposed))
        return solution


ROUNDING = 1e-9
"""Growth slower than this share of the stiffness (damping is one) is rounding error."""


@dataclass(frozen=True)
class Stability:
    """Verdict and, as a warning, whether the tangent's symmetric part is positive definite."""

    stable: bool
    symmetric_part_positive: bool


MOST_ITERATIONS = 40
"""Newton's, steps that were cut back among them."""

OVERSHOT, LEAST_SHARE = 0.5, 0.1
"""A step is cut back where the load against it is more than this share of what drove it; to the
zero of the straight line between both, but to no less than this share."""

LONGEST_STEP = 0.5
"""rad: no joint turns further in one step of Newton, for its tangent tells nothing so far off."""

FIRST_INCREMENT = 0.25
"""Fraction of a load that is tried when it does not come on at once."""

SMALLEST_FRACTION = 2.0**-20
"""Stability is lost where a load increment this small is not certified. A column that is pushed
aside by 1e-9 of its stiffness still finds its way past its critical load."""

LARGEST_ROTATION = np.deg2rad(80.0)
"""Rotations beyond this are no joint motion and near the singularity of Z, X', Y''."""

NOT_POSITIVE = (
    "stable, though the tangent's symmetric part is not positive definite (large constant moment)"
)

PAST_CRITICAL = "past a critical load: under it the neutral pose would not be stable"

# Newton squares its error: once a step is below these, the next would be below rounding.
STEP_TOLERANCE = np.array([1e-11] * 3 + [1e-9] * 3)

RADIANS = STEP_TOLERANCE[5] / STEP_TOLERANCE
"""By which lengths are held against angles: 1 cm counts as 1 rad."""

SPACING = 0.25
"""rad: the tangent is looked at so often along a step, or as often as a law asks for."""

STRAIGHT, FEWEST, MOST = 0.5, 3, 60
"""A step from which Newton's first differs by more than this share is not longer than `SPACING`,
and is looked at so many times at least; and at most."""


@dataclass(frozen=True)
class Equilibrium:
    """End of a solve.

    Attributes
    ----------
    q : (n,) m and rad; the last stable pose when the status is not converged.
    factored : LU of the tangent there, or None.
    iterations : Newton iterations in all. reached : fraction of the load increment carried.
    """

    q: Array
    factored: LUFactors | None
    status: Status
    message: str
    iterations: int
    reached: float


@dataclass(frozen=True)
class NewtonResult:
    """How Newton went.

    Attributes
    ----------
    q : (n,) where it ended. arrived : whether that is an equilibrium, if any joint's motion goes
        so far. factored, tangent : there.
    first : (n,) its first step. at_start : tangent (n, n) where it began.
    """

    q: Array
    arrived: bool
    factored: LUFactors | None
    tangent: Array
    iterations: int
    first: Array
    at_start: Array

    @property
    def within_motion(self) -> bool:
        """Whether no joint turns further than joints do."""
        return bool(np.abs(self.q.reshape(-1, 6)[:, 3:]).max() <= LARGEST_ROTATION)


def solve(
    system: System,
    origin: Array,
    loading_from: Loading,
    loading_to: Loading,
    states: States,
    guess: Array | None = None,
    step: int = 0,
) -> Equilibrium:
    """Equilibrium to which a load leads from the one at ``origin`` (n,) under ``loading_from``.

    Parameters
    ----------
    guess : (n,) pose close to it, where Newton starts. step : number of the step, for messages.
    """
    q, reached, increment, iterations = origin, 0.0, 1.0, 0
    before, start = loading_from, guess
    while True:
        target = min(1.0, reached + increment)
        after = loading_to if target == 1.0 else loading_from.towards(loading_to, target)
        result = newton(system, q if start is None else start, after, states)
        iterations += result.iterations
        verdict = certify(system, q, before, after, states, result, start is not None)
        if verdict is not None:
            q, before, reached, increment = result.q, after, target, 2.0 * increment
            if reached == 1.0:
                assert result.factored is not None
                warning = "" if verdict.symmetric_part_positive else NOT_POSITIVE
                if _past_critical(system, loading_to):
                    warning = PAST_CRITICAL
                return Equilibrium(
                    q, result.factored, Status.CONVERGED, warning, iterations, reached
                )
        elif start is None:
            increment = min(FIRST_INCREMENT, 0.5 * increment)
            if increment < SMALLEST_FRACTION:
                turned = result.arrived and not result.within_motion
                ahead = loading_from.towards(loading_to, min(1.0, reached + SMALLEST_FRACTION))
                message = _lost(system, q, before, ahead, states, turned, step)
                message = f"{message} beyond {100.0 * reached:.1f} % of the load increment"
                return Equilibrium(q, None, Status.UNSTABLE, message, iterations, reached)
        start = None


def certify(
    system: System,
    origin: Array,
    before: Loading,
    after: Loading,
    states: States,
    result: NewtonResult,
    guessed: bool,
) -> Stability | None:
    """How stable the end of Newton is, if a path of stable equilibria leads there from an origin.

    Parameters
    ----------
    origin : (n,) equilibrium under ``before``. guessed : whether Newton did not start there.
    """
    # 1: the end is stable
    if not (result.arrived and result.within_motion):
        return None
    assert result.factored is not None
    verdict = stability(system.chain, result.q, result.tangent, result.factored.sign, system.free)
    if not verdict.stable:
        return None
    # 2: the tangent is positive at the origin under the load after the step
    begin, first, tangent = system.start(origin, after), result.first, result.at_start
    if guessed:
        balance = system.balance(begin, after, states)
        tangent = balance.tangent
        try:
            first = factor(tangent).solve(-balance.residual)
        except SingularTangent:
            return None
    if not stands(system, tangent):
        return None
    # 3: in between under both loads, and at the end under the load before
    effects = [active.effect for active in (*system.laws, *system.geometry)]
    spacing = np.array([min([SPACING, *map(straight_over, effects)])])
    begun, ended, told = (one.reshape(1, -1, 6) for one in (begin, result.q, first))
    near, _, shares = places_between(begun, ended, told, spacing)
    if not near.all():
        return None
    between = begin + shares[:, None] * (result.q - begin)
    looks = [(there, after) for there in between]
    if before.share > 0.0 or before.forces.any() or before.moments.any():
        looks += [(there, before) for there in (result.q, *between)]
    for there, loading in looks:
        if not stands(system, system.balance(there, loading, states).tangent):
            return None
    return verdict


def places_between(
    begin: Array, end: Array, first: Array, spacing: Array
) -> tuple[NDArray[np.bool_], Indices, Array]:
    """Which steps of N lanes are near enough, (N,), and where these are looked at.

    Parameters
    ----------
    begin, end, first : (N, J, 6) poses, and Newton's first step from the one.
    spacing : (N,) rad, places are at most as far apart.

    Returns
    -------
    Beside the former: lanes and shares (K,) of their way.
    """
    way = end - begin
    length = np.abs(way * RADIANS).max(axis=(1, 2))
    bent = np.abs((way - first) * RADIANS).max(axis=(1, 2)) > STRAIGHT * length
    near = ~bent | (length <= SPACING)
    count = np.ceil(length / spacing).astype(np.int64) - 1
    count = np.clip(np.where(bent, np.maximum(count, FEWEST), count), 0, MOST)
    count = np.where(near, count, 0)
    lanes = np.repeat(np.arange(len(count)), count)
    places = np.arange(len(lanes)) - np.repeat(np.cumsum(count) - count, count)
    return near, lanes, (places + 1) / (count[lanes] + 1)


def stands(system: System, tangent: Array) -> bool:
    """Whether a chain without inertia would not move away from a pose with this tangent (n, n)."""
    free = system.free
    own = tangent if free is None else tangent[np.ix_(free, free)]
    if _positive(own + own.T):
        return True
    if not np.isfinite(own).all() or np.array_equal(own, own.T):
        return False
    scale = 1.0 / np.sqrt(system.chain.model.damping.ravel())
    scale = scale if free is None else scale[free]
    return decays(np.zeros_like(own), own * scale[:, None] * scale)


def _past_critical(system: System, loading: Loading) -> bool:
    """Whether the neutral pose would move away under forces."""
    heavy = loading.share > 0.0 and bool(np.any(system.model.gravity))
    if not (heavy or loading.forces.any()):
        return False
    loading = system.unloaded().towards(loading, 1.0 - ROUNDING)
    neutral = system.start(np.zeros(system.chain.n), loading)
    tangent = system.balance(neutral, loading, system.initial_states()).tangent
    return not stands(system, tangent)


def _lost(
    system: System,
    q: Array,
    before: Loading,
    ahead: Loading,
    states: States,
    turned: bool,
    step: int,
) -> str:
    """How a path ends at q (n,): it tips over at a fork, where the load does no work, or snaps.

    The coordinate that gives way has the largest part in the motion that nothing resists; few
    steps of inverse iteration tell it, for the tangent is all but singular.
    """
    if turned:
        limit = f"{np.rad2deg(LARGEST_ROTATION):.0f} degrees"
        return f"a joint turns beyond {limit}, the limit of joint motion, under step {step},"
    try:
        factored = factor(system.balance(q, before, states).tangent)
    except SingularTangent:
        return f"tips over or snaps under the load of step {step}: it loses stability"
    # inverse iteration for the right and the left null vector of the tangent, from any start
    motion, work = np.random.default_rng(0).normal(size=(2, len(q)))
    for _ in range(8):
        motion, work = factored.solve(motion), factored.solve(work, transposed=True)
        motion, work = motion / np.linalg.norm(motion), work / np.linalg.norm(work)
    parts = np.abs(motion * np.tile(RADIANS, len(q) // 6))
    joint, at = divmod(int(np.argmax(parts)), 6)
    missing = system.balance(q, ahead, states).residual
    fork = abs(work @ missing) < FORK * np.linalg.norm(missing)
    how = "tips over" if fork else "snaps"
    where = f"{COORDINATES[at].replace('_', ' ')} of {system.model.joints[joint]}"
    return f"{how} under the load of step {step}: {where} loses stability"


FORK = 1e-6
"""At a fork the load does no more than this share of its work along the motion that is free."""


def newton(system: System, start: Array, loading: Loading, states: States) -> NewtonResult:
    """Newton with a line search, from ``start`` (n,).

    A step is cut back where the load against it has grown to more than half of what drove it, or
    is infinite beyond the ends of a law. It is given up where the tangent's determinant is not
    positive: there the path has been left.
    """
    q = system.start(start, loading)
    step, drive = np.zeros(len(q)), 0.0
    first, at_start = step, np.zeros((len(q), len(q)))
    factored: LUFactors | None = None
    for iteration in range(1, MOST_ITERATIONS + 1):
        balance = system.balance(q, loading, states)
        work = float(balance.residual @ step)
        # line search: the work along the last step was -drive at its start and is this at its end
        if not work <= OVERSHOT * drive:
            if drive <= 0.0:
                break
            share = float(np.clip(drive / (drive + work), LEAST_SHARE, 0.5))
            share = share if np.isfinite(work) else 0.5
            q = q - (1.0 - share) * step
            step, drive = share * step, share * drive
            continue
        try:
            factored = factor(balance.tangent)
        except SingularTangent:
            break
        step = factored.solve(-balance.residual)
        if iteration == 1:
            first, at_start = step, balance.tangent
        if factored.sign < 0:
            break
        size = float((np.abs(step).reshape(-1, 6) / STEP_TOLERANCE).max())
        step = step * min(1.0, LONGEST_STEP / max(np.abs(step.reshape(-1, 6)[:, 3:]).max(), 1e-300))
        q = q + step
        drive = -float(balance.residual @ step)
        drive = drive if drive > 0.0 else np.inf
        if size < 1.0:
            return NewtonResult(q, True, factored, balance.tangent, iteration, first, at_start)
        if not np.abs(q.reshape(-1, 6)[:, 3:]).max() < np.pi:
            break
    return NewtonResult(q, False, factored, at_start, iteration, first, at_start)


def factor(tangent: Array) -> LUFactors:
    """Factor a tangent.

    Raises
    ------
    SingularTangent
        When it is singular or not finite.
    """
    if not np.isfinite(tangent).all():
        raise SingularTangent("the tangent is not finite")
    lu, pivots, info = dgetrf(tangent)
    if info != 0:
        raise SingularTangent("the tangent is singular")
    swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
    negative = np.count_nonzero(np.diagonal(lu) < 0.0)
    return LUFactors(lu, pivots, -1 if (swaps + negative) % 2 else 1)


def stability(
    chain: Chain, q: Array, tangent: Array, sign: int, free: Indices | None = None
) -> Stability:
    """Stability of the equilibrium at q (n,) with tangent K (n, n), its determinant's sign.

    Only the motion of the coordinates that are free counts; None for all.

    An odd number of growing modes shows as a negative determinant. With K = S + A (symmetric and
    skew parts) and in coordinates where the damping is the identity, the motion decays for sure
    when S - |A|^2 M is positive definite: each mode x of the pencil then obeys
    m l^2 + l + (s + i a) = 0 with a^2 m < s, whose roots have negative real parts.
    """
    damping = chain.model.damping.ravel()
    if free is not None:
        damping, tangent = damping[free], tangent[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(damping)
    scaled = tangent * scale[:, None] * scale
    skew = 0.5 * (scaled - scaled.T)
    symmetric = scaled - skew
    positive = _positive(symmetric)
    if sign < 0:
        return Stability(stable=False, symmetric_part_positive=positive)
    if np.array_equal(tangent, tangent.T):  # then inertia and damping decide nothing
        return Stability(stable=positive, symmetric_part_positive=positive)
    twist = 0.5 * float(np.sum(skew * skew))  # |A|^2: a skew matrix's singular values are pairs
    mass = chain.mass_matrix(q)
    if free is not None:
        mass = mass[np.ix_(free, free)]
    mass = mass * scale[:, None] * scale
    sure = positive and _positive(symmetric - twist * mass)
    return Stability(sure or decays(mass, scaled), positive)


def _positive(symmetric: Array) -> bool:
    """Whether a symmetric matrix is positive definite: whether Cholesky goes through."""
    _, refused = dpotrf(symmetric, lower=True)
    return not refused


def decays(mass: Array, stiffness: Array) -> bool:
    """Whether all modes of M x'' + x' + K x = 0 decay; massless chains follow x' + K x = 0.

    A growing mode l (m l + 1) = -k has |m l + 1| > 1, hence |l| < |K|: rates beyond are those of
    directions without inertia, infinite but for rounding, which may give them either sign.
    """
    n = len(stiffness)
    if not mass.any():
        return float(eigvals(stiffness).real.min()) > 0.0
    identity, nothing = np.eye(n), np.zeros((n, n))
    # first-order form, b d/dt (x, x') = a (x, x'): M may be singular, so that it is not inverted
    a = np.block([[nothing, identity], [-stiffness, -identity]])
    b = np.block([[identity, nothing], [nothing, mass]])
    rates, size = eigvals(a, b), float(np.linalg.norm(stiffness))
    slow = rates[np.abs(rates) < size]
    return float(slow.real.max(initial=-np.inf)) < ROUNDING * size
