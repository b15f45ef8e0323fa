"""Chains whose loads come on slowly, by virtual work alone: many poses at once, plain numpy.

The load on a coordinate is the work of all forces and moments along a small motion of it, taken by
central differences of places and turns. Nothing of a tangent is known: it is differenced again.
"""

from typing import NamedTuple

import numpy as np

from .chain import Array, Chain

MOVE = 1e-4
"""m and rad: a central difference errs by its square."""


MOST_MOVED = 0.03
"""m and rad in one step: twice as much may lie between the two sides of a fork."""


class Slowly(NamedTuple):
    """Pose (J, 6) at which a slow load has arrived or stability was lost, and the share carried."""

    q: Array
    share: float


def slowly(chain: Chain, steps: int) -> Slowly:
    """Bring all loads on in proportion, in so many steps or more, while no motion grows.

    A step that moves anything by more than `MOST_MOVED`, or after which a motion grows, is
    taken again in quarters; smaller than a thousandth of one it is where stability is lost.
    """
    q, share, size = np.zeros(6 * chain.n_joints), 0.0, 1.0 / steps
    while share < 1.0:
        following = min(1.0, share + size)
        there = _balanced(chain, q, following)
        if there is not None and np.abs(there - q).max() < MOST_MOVED:
            q, share, size = there, following, min(2.0 * size, 1.0 / steps)
        elif size > 1e-3 / steps:
            size *= 0.25
        else:
            break
    return Slowly(q.reshape(-1, 6), share)


def _balanced(chain: Chain, start: Array, share: float) -> Array | None:
    """Pose (n,) near a start that balances a share of the loads and does not move away."""
    q, moves = start, MOVE * np.eye(len(start))
    for _ in range(8):
        loads = held(chain, np.vstack([q, q + moves, q - moves]), share)
        tangent = (loads[1 : len(q) + 1] - loads[len(q) + 1 :]).T / (2.0 * MOVE)
        step = np.linalg.solve(tangent, -loads[0])
        q = q + step
        if np.abs(step).max() < 1e-9:
            damped = tangent / chain.damping.ravel()[:, None]
            stands = np.linalg.eigvals(damped).real.min() > 0.0
            within = np.abs(q.reshape(-1, 6)[:, 3:]).max() < np.deg2rad(80.0)
            return q if stands and within else None
    return None


def held(chain: Chain, q: Array, share: float) -> Array:
    """(B, n) what springs hold less the work of a share of the loads, at poses q (B, n)."""
    count, n = q.shape
    moves = MOVE * np.eye(n)
    moved = np.stack([q[:, None] + moves, q[:, None] - moves])  # (2, B, n, n)
    turns, places = _placed(chain, moved.reshape(-1, chain.n_joints, 6))
    work = np.zeros((2, count, n))
    twist = np.zeros((count, n))
    for load in chain.loads:
        turn = turns[load.body].reshape(2, count, n, 3, 3)
        place = places[load.body].reshape(2, count, n, 3)
        work += (np.einsum("...rc,c->...r", turn, load.point) + place) @ load.force
        small = np.einsum("bnrc,bnkc->bnrk", turn[0], turn[1])
        about = np.stack([small[..., 2, 1], small[..., 0, 2], small[..., 1, 0]], axis=-1)
        about -= np.stack([small[..., 1, 2], small[..., 2, 0], small[..., 0, 1]], axis=-1)
        twist += 0.5 * about @ load.moment
    applied = (work[0] - work[1] + twist) / (2.0 * MOVE)
    result: Array = q * chain.stiffness.ravel() - share * applied
    return result


def _placed(chain: Chain, q: Array) -> tuple[list[Array], list[Array]]:
    """Turn (B, 3, 3) and shift (B, 3) of each body from the neutral pose, at q (B, J, 6)."""
    turn, shift = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    turns, shifts = [], []
    for joint in range(chain.n_joints):
        axes, origin = chain.rotations[joint], chain.origins[joint]
        own = axes @ _turned(q[:, joint, 3:]) @ axes.T
        # about the joint's origin, then along its axes, then as the body below
        slid = q[:, joint, :3] @ axes.T + origin - own @ origin
        shift = shift + np.einsum("brc,bc->br", turn, slid)
        turn = turn @ own
        turns.append(turn)
        shifts.append(shift)
    return turns, shifts


def _turned(angles: Array) -> Array:
    """(B, 3, 3) about z, then the new x, then the new y."""
    result = np.eye(3)
    for at, axis in enumerate((2, 0, 1)):
        c, s = np.cos(angles[:, at]), np.sin(angles[:, at])
        one = np.zeros((len(angles), 3, 3))
        j, k = (axis + 1) % 3, (axis + 2) % 3
        one[:, axis, axis], one[:, j, j], one[:, k, k] = 1.0, c, c
        one[:, j, k], one[:, k, j] = -s, s
        result = result @ one
    return result
