"""Equilibrium by Newton with the exact tangent, continued along the load; is it stable?

The LU factors of a tangent serve the step, the determinant and the sensitivities.

Across corners in a path law Newton is held back by a line search. Friction meets a joint that turns
on and one that turns back with different slopes, and full steps may jump to and fro between them.
The load is still continuous and grows along every direction, so the work along a step has a least
value; steps that stop near it arrive.

Stability is decided by the linearised damped motion M x'' + C x' + K x = 0. K is not symmetric
under a constant moment, so its symmetric part alone decides nothing. Cheap sufficient tests come
first; the 2n eigenvalues are computed only when these leave a doubt.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf
from scipy.optimize import brentq

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.holding import States
from spinepipe.statics.system import Loading, System
from spinepipe.status import Status
from spinepipe.world import Chain


class SingularTangent(ArithmeticError):
    """The tangent has no inverse at this pose."""


@dataclass(frozen=True)
class Factored:
    """LU factors of K (n, n); `sign` of its determinant."""

    lu: Array
    pivots: Array
    sign: int

    def solve(self, right: Array) -> Array:
        """K^-1 times (n,) or (n, m)."""
        solution, _ = dgetrs(self.lu, self.pivots, right)
        return solution


MOST_STEPS = 60

NEAR = np.array([1e-9] * 3 + [1e-7] * 3)
"""m and rad: a step this small ends on the pose's side of every corner that matters."""

ROUNDING = 1e-9
"""Growth slower than this share of the stiffness (damping is one) is rounding error."""


@dataclass(frozen=True)
class Stability:
    """Verdict and, as a warning, whether the tangent's symmetric part is positive definite."""

    stable: bool
    symmetric_part_positive: bool


MOST_ITERATIONS = 12

FIRST_INCREMENT = 0.25
"""Fraction of a load that is tried when it does not come on at once."""

SMALLEST_FRACTION = 1.0 / 1024.0
"""Continuation gives up when a load increment this small does not contract."""

LARGEST_ROTATION = np.deg2rad(80.0)
"""Rotations beyond this are no joint motion and near the singularity of Z, X', Y''."""

NOT_POSITIVE = (
    "stable, though the tangent's symmetric part is not positive definite (large constant moment)"
)

# Newton squares its error: once a step is below these, the next would be below rounding.
STEP_TOLERANCE = np.array([1e-11] * 3 + [1e-9] * 3)


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
    factored: Factored | None
    status: Status
    message: str
    iterations: int
    reached: float


@dataclass(frozen=True)
class _Newton:
    q: Array
    factored: Factored
    tangent: Array
    iterations: int


def solve(
    system: System, start: Array, loading_from: Loading, loading_to: Loading, states: States
) -> Equilibrium:
    """Equilibrium under ``loading_to``, starting from the one at ``start`` under ``loading_from``.

    The full increment is tried first; if Newton does not contract or ends unstable, it is held back
    across the corners of path laws where there are any; at last the load is
    continued in fractions that halve on failure and double on success.
    """
    direct = _newton(system, start, loading_to, states)
    if direct is not None and (verdict := _stability(system, direct)).stable:
        return _converged(direct, direct.iterations, verdict)
    if system.paths and (near := approach(system, start, loading_to, states)) is not None:
        held_back = _newton(system, near, loading_to, states)
        if held_back is not None and (verdict := _stability(system, held_back)).stable:
            return _converged(held_back, held_back.iterations, verdict)
    return _continue(system, start, loading_from, loading_to, states)


def _continue(
    system: System, start: Array, loading_from: Loading, loading_to: Loading, states: States
) -> Equilibrium:
    reached, increment, iterations = 0.0, FIRST_INCREMENT, 0
    last: _Newton | None = None
    verdict: Stability | None = None
    while reached < 1.0:
        target = min(1.0, reached + increment)
        loading = loading_from.towards(loading_to, target)
        q = start if last is None else last.q
        found = _newton(system, q, loading, states)
        iterations += MOST_ITERATIONS if found is None else found.iterations
        if found is not None and (here := _stability(system, found)).stable:
            verdict, last, reached, increment = here, found, target, 2.0 * increment
        elif increment > SMALLEST_FRACTION:
            increment *= 0.5
        else:
            turned_too_far = found is None and _stands_beyond_motion(system, q, loading, states)
            return _stopped(q, found, turned_too_far, reached, iterations)
    assert last is not None
    assert verdict is not None
    return _converged(last, iterations, verdict)


def _converged(found: _Newton, iterations: int, verdict: Stability) -> Equilibrium:
    """A stable pose; a tangent whose symmetric part is not positive is worth a warning."""
    warning = "" if verdict.symmetric_part_positive else NOT_POSITIVE
    return Equilibrium(found.q, found.factored, Status.CONVERGED, warning, iterations, 1.0)


def _stopped(
    q: Array, found: _Newton | None, turned_too_far: bool, reached: float, iterations: int
) -> Equilibrium:
    """Continuation stalled: past the last stable pose there is an unstable one, or none near."""
    share = f"{100.0 * reached:.1f} % of the load increment"
    message = f"no equilibrium near the last one beyond {share}: it tips over or snaps"
    if found is not None:
        message = f"the segment loses stability beyond {share}"
    elif turned_too_far:
        limit = f"{np.rad2deg(LARGEST_ROTATION):.0f} degrees"
        message = f"a joint turns beyond {limit}, the limit of joint motion, beyond {share}"
    return Equilibrium(q, None, Status.UNSTABLE, message, iterations, reached)


def _stands_beyond_motion(system: System, start: Array, loading: Loading, states: States) -> bool:
    """Whether there is a stable pose nearby, but one that no joint reaches."""
    found = _newton(system, start, loading, states, largest=np.inf)
    return found is not None and _stability(system, found).stable


def _newton(
    system: System,
    start: Array,
    loading: Loading,
    states: States,
    largest: float = LARGEST_ROTATION,
) -> _Newton | None:
    """Newton from ``start``; None unless the steps contract onto a pose within joint motion.

    A step beyond the ends of a law, where it carries without limit, is halved. ``largest`` is the
    rotation where joint motion ends, rad.
    """
    q, last = system.start(start, loading), np.inf
    step: Array | None = None
    for iteration in range(1, MOST_ITERATIONS + 1):
        balance = system.balance(q, loading, states)
        if step is not None and not np.isfinite(balance.residual).all():
            step = 0.5 * step
            q = q - step
            continue
        try:
            factored = factor(balance.tangent)
        except SingularTangent:
            return None
        step = factored.solve(-balance.residual)
        size = float((np.abs(step).reshape(-1, 6) / STEP_TOLERANCE).max())
        q = q + step
        if not size < 4.0 * last or np.abs(q.reshape(-1, 6)[:, 3:]).max() > largest:
            return None
        if size < 1.0:
            return _Newton(q, factored, balance.tangent, iteration)
        last = size
    return None


def _stability(system: System, found: _Newton) -> Stability:
    return stability(system.chain, found.q, found.tangent, found.factored.sign, system.free)


def approach(system: System, start: Array, loading: Loading, states: States) -> Array | None:
    """Pose (n,) next to the equilibrium under a loading, or None when the way there is lost."""
    q = system.start(start, loading)
    for _ in range(MOST_STEPS):
        balance = system.balance(q, loading, states)
        try:
            step = factor(balance.tangent).solve(-balance.residual)
        except SingularTangent:
            return None
        if not balance.residual @ step < 0.0:
            return None
        step = step * _share(system, q, step, loading, states, float(balance.residual @ step))
        q = q + step
        if (np.abs(step).reshape(-1, 6) < NEAR).all():
            return q
    return None


def _share(
    system: System, q: Array, step: Array, loading: Loading, states: States, slope: float
) -> float:
    """Share of a step at which the work along it is near its least, or the whole step."""

    def work(share: float) -> float:
        return float(system.residual(q + share * step, loading, states) @ step)

    if not work(1.0) > -0.5 * slope:
        return 1.0
    share: float = brentq(work, 0.0, 1.0, xtol=1e-9, rtol=0.1)
    return share


def factor(tangent: Array) -> Factored:
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
    return Factored(lu, pivots, -1 if (swaps + negative) % 2 else 1)


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
    a = np.block([[nothing, identity], [-stiffness, -identity]])
    b = np.block([[identity, nothing], [nothing, mass]])
    rates, size = eigvals(a, b), float(np.linalg.norm(stiffness))
    slow = rates[np.abs(rates) < size]
    return float(slow.real.max(initial=-np.inf)) < ROUNDING * size
