"""Newton on many lanes at once: stable equilibria near the poses where it starts."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.equilibrium import LARGEST_ROTATION, MOST_ITERATIONS, STEP_TOLERANCE
from spinepipe.statics.many.bound import Bound
from spinepipe.statics.many.elimination import Changes, answers
from spinepipe.statics.many.stability import surely_stable
from spinepipe.statics.many.survey import Chains, Loads, part, survey

Flags = NDArray[np.bool_]

Laws = Callable[[Indices], Bound]
"""What is at work on some of the lanes."""


def settled(chains: Chains, loads: Loads, laws: Laws, start: Array) -> tuple[Array, Flags]:
    """Poses (N, J, 6) of lanes from poses near by, and which are stable equilibria for sure."""
    q, tangents, arrived = newton(chains, loads, laws, start)
    there = np.flatnonzero(arrived)
    arrived[there] = surely_stable(chains, part(loads, there), q[there], tangents[there])
    return q, arrived


def newton(chains: Chains, loads: Loads, laws: Laws, start: Array) -> tuple[Array, Array, Flags]:
    """Poses (N, J, 6), tangents there (N, J, 6, 6), and which lanes have arrived (N,).

    A lane whose steps do not contract, or that leaves joint motion, is given up. A step beyond the
    ends of a law, where it carries without limit, is halved.
    """
    q = loads.supports.on(start)
    tangents = np.zeros((*q.shape, 6))
    arrived = np.zeros(len(q), dtype=bool)
    left: Indices = np.arange(len(q))
    last, taken = np.full(len(q), np.inf), np.zeros_like(q)
    bound, acting = laws(left), loads
    for _ in range(MOST_ITERATIONS):
        here = q[left]
        held = bound.held(here)
        step, solved = newton_step(chains, acting, here, held.load, held.tangent)
        beyond = _without_limit(held.load)
        some_beyond = beyond.any()
        if some_beyond:
            step[beyond], solved[beyond] = -0.5 * taken[beyond], taken[beyond].any(axis=(1, 2))
        q[left] = here = here + step
        size = (np.abs(step) / STEP_TOLERANCE).max(axis=(1, 2))
        inside = np.abs(here[..., 3:]).max(axis=(1, 2)) <= LARGEST_ROTATION
        going = solved & inside & (size < 4.0 * last)
        there = going & (size < 1.0) & ~beyond
        arrived[left[there]] = True
        tangents[left[there]] = held.tangent[there]
        going &= ~there
        if not going.any():
            break
        if some_beyond:
            step[beyond] *= -1.0  # as much of the step before is left
        last, taken = np.where(beyond, last, size)[going], step[going]
        if not going.all():
            left = left[going]
            bound, acting = laws(left), part(loads, left)
    return q, tangents, arrived


def _without_limit(load: Array) -> Flags:
    """(N,) lanes with a joint that holds without limit, of loads (N, J, 6)."""
    found: Flags = np.logical_not(np.isfinite(load).all(axis=(1, 2)))
    return found


def newton_step(
    chains: Chains, loads: Loads, q: Array, held: Array, tangents: Array
) -> tuple[Array, Flags]:
    """Newton steps (N, J, 6) from q, and on which lanes there is one."""
    seen = survey(chains, loads, q, tangents)
    rates, good = answers(seen, Changes((seen.applied - held)[..., None]))
    return rates[..., 0], good
