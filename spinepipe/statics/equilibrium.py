"""Equilibrium by Newton with the exact tangent, continued along the load when it must be."""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics.damped import approach
from spinepipe.statics.holding import States
from spinepipe.statics.linear import Factored, SingularTangent, factor
from spinepipe.statics.loading import Loading
from spinepipe.statics.stability import Stability, stability
from spinepipe.statics.status import Status
from spinepipe.statics.system import System

MOST_ITERATIONS = 12
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
    reached, increment, iterations = 0.0, 0.25, 0
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
            return _stopped(start if last is None else last.q, found, reached, iterations)
    assert last is not None
    assert verdict is not None
    return _converged(last, iterations, verdict)


def _converged(found: _Newton, iterations: int, verdict: Stability) -> Equilibrium:
    """A stable pose; a tangent whose symmetric part is not positive is worth a warning."""
    warning = "" if verdict.symmetric_part_positive else NOT_POSITIVE
    return Equilibrium(found.q, found.factored, Status.CONVERGED, warning, iterations, 1.0)


def _stopped(q: Array, found: _Newton | None, reached: float, iterations: int) -> Equilibrium:
    """Continuation stalled: past the last stable pose there is an unstable one, or none near."""
    share = f"{100.0 * reached:.1f} % of the load increment"
    if found is not None:
        message = f"the segment loses stability beyond {share}"
        return Equilibrium(q, None, Status.UNSTABLE, message, iterations, reached)
    message = f"no equilibrium near the last one beyond {share}: it tips over or snaps"
    return Equilibrium(q, None, Status.UNSTABLE, message, iterations, reached)


def _newton(system: System, start: Array, loading: Loading, states: States) -> _Newton | None:
    """Newton from ``start``; None unless the steps contract onto a pose within joint motion."""
    q, last = start, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        balance = system.balance(q, loading, states)
        try:
            factored = factor(balance.tangent)
        except SingularTangent:
            return None
        step = factored.solve(-balance.residual)
        size = float((np.abs(step).reshape(-1, 6) / STEP_TOLERANCE).max())
        q = q + step
        if not size < 4.0 * last or _beyond_motion(q):
            return None
        if size < 1.0:
            return _Newton(q, factored, balance.tangent, iteration)
        last = size
    return None


def _beyond_motion(q: Array) -> bool:
    return bool(np.abs(q.reshape(-1, 6)[:, 3:]).max() > LARGEST_ROTATION)


def _stability(system: System, found: _Newton) -> Stability:
    return stability(system.chain, found.q, found.tangent, found.factored.sign)
