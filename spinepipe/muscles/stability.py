"""Whether a held posture stands still when it is pushed a little.

The spine may turn and move at all seven joints: 42 coordinates, each a small turn or move of all
that is above a joint. The stiffness against them is that of the joints, of the muscles (short-range
stiffness: q times force over length, and the slope of what is stretched), and of all forces that
change their lever arms, pulls and weights alike. Where the smallest eigenvalue is negative the
posture falls over, and more tone is needed (Bergmark 1989). Contacts of fascicles and arms are
taken as fixed to the bodies, and pulls on the rectus sheath as dead loads.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.muscles.person import Person
from spinepipe.muscles.settle import Held
from spinepipe.muscles.trunk import LEVELS

LENGTH_M = 0.05
"""Makes moves comparable with turns: a move of so much counts like a turn of 1 rad."""

_N = 6 * len(LEVELS)


def smallest_eigenvalue(person: Person, held: Held, gain: float) -> float:
    """N m/rad; below nought the posture falls over.

    Parameters
    ----------
    gain : q of a muscle's stiffness q force / length.
    """
    scale = np.tile([1.0, 1.0, 1.0, *[LENGTH_M] * 3], len(LEVELS))
    matrix = stiffness(person, held, gain) * np.outer(scale, scale)
    return float(eigh(0.5 * (matrix + matrix.T))[0][0])


def stiffness(person: Person, held: Held, gain: float) -> Array:
    """(42, 42) N m/rad, N/rad and N/m: turns (3) and moves (3) in ground axes, joint by joint."""
    muscles, pulls = person.lines.trunk.muscles, held.pulls
    forces = held.found.forces
    arms = held.demand.arms.T.reshape(len(muscles), -1, 3)
    drawn = np.cumsum(pulls.forces[:, :0:-1], axis=1)[:, ::-1]
    slopes = np.concatenate([arms, drawn], axis=2).reshape(len(muscles), _N)
    strength = held.demand.most - held.stretched
    rising = person.passive.slopes(pulls.lengths, person.rest, person.fibres, strength)
    found: Array = slopes.T @ ((gain * forces / pulls.lengths + rising)[:, None] * slopes)
    found += _joints(person, held)
    tensors, weights = _tensors(held)
    found += _changing_arms(tensors, weights)
    found += _turning_lines(pulls.trace, pulls.traced, pulls.on, forces, held.poses.centres)
    return found


def _joints(person: Person, held: Held) -> Array:
    """Stiffness of the joints, block by block."""
    found = np.zeros((_N, _N))
    turning = person.laws.slopes(held.poses.turned, held.compression)
    for level, disc in enumerate(held.poses.discs):
        at = 6 * level
        found[at : at + 3, at : at + 3] = disc @ np.diag(turning[level]) @ disc.T
        moving = np.diag(
            [person.laws.shear[level, 0], person.laws.axial[level], person.laws.shear[level, 1]]
        )
        found[at + 3 : at + 6, at + 3 : at + 6] = disc @ moving @ disc.T
    return found


def _tensors(held: Held) -> tuple[Array, Array]:
    """Of all forces above each joint: (7, 3, 3) sum of arm times force, N m, and (7, 3) sum, N."""
    loads = held.applied
    pulls = held.pulls
    at, on, pull = _line_forces(pulls.trace, pulls.traced, pulls.on, held.found.forces)
    points, forces = np.vstack([loads.at, at]), np.vstack([loads.pushes, pull])
    bodies = np.concatenate([loads.bodies, on])
    tensors, weights = np.zeros((len(LEVELS), 3, 3)), np.zeros((len(LEVELS), 3))
    for level, centre in enumerate(held.poses.centres):
        above = bodies > level
        tensors[level] = (points[above] - centre).T @ forces[above]
        weights[level] = forces[above].sum(axis=0)
    return tensors, weights


def _changing_arms(tensors: Array, weights: Array) -> Array:
    """Stiffness of forces that keep their direction while their points move.

    A turn a of all above joint k and one b above joint m, k below m, move a point by
    a x (b x r) more than the two alone, r its arm at m; a move t at m is turned by a.
    """
    found = np.zeros((_N, _N))
    for upper in range(len(LEVELS)):
        tensor = tensors[upper]
        turn = np.trace(tensor) * np.eye(3) - tensor
        force = weights[upper]
        cross = np.array(
            [[0.0, -force[2], force[1]], [force[2], 0.0, -force[0]], [-force[1], force[0], 0.0]]
        )
        for lower in range(upper + 1):
            a, b = slice(6 * lower, 6 * lower + 3), slice(6 * upper, 6 * upper + 3)
            if lower == upper:
                found[a, a] += 0.5 * (turn + turn.T)
                continue
            found[a, b] += turn
            found[b, a] += turn.T
            move = slice(6 * upper + 3, 6 * upper + 6)
            found[a, move] += cross
            found[move, a] += cross.T
    return found


@njit(cache=True)
def _line_forces(
    trace: Array, traced: NDArray[np.int64], body: NDArray[np.int64], forces: Array
) -> tuple[Array, NDArray[np.int64], Array]:
    """Points (K, 3), bodies (K,) and forces (K, 3) of strings, legs within a body left out."""
    most = 2 * trace.shape[0] * trace.shape[1]
    at, on, pull = np.zeros((most, 3)), np.zeros(most, dtype=np.int64), np.zeros((most, 3))
    k = 0
    for m in range(len(traced)):
        for leg in range(traced[m] - 1):
            if body[m, leg] == body[m, leg + 1] or forces[m] == 0.0:
                continue
            d = trace[m, leg + 1] - trace[m, leg]
            u = d / np.sqrt(d @ d)
            at[k], on[k], pull[k] = trace[m, leg], body[m, leg], forces[m] * u
            at[k + 1], on[k + 1], pull[k + 1] = trace[m, leg + 1], body[m, leg + 1], -forces[m] * u
            k += 2
    return at[:k], on[:k], pull[:k]


@njit(cache=True)
def _turning_lines(
    trace: Array,
    traced: NDArray[np.int64],
    body: NDArray[np.int64],
    forces: Array,
    centres: Array,
) -> Array:
    """Stiffness of strings under tension against being moved across their line."""
    levels = len(centres)
    n = 6 * levels
    found = np.zeros((n, n))
    across = np.zeros((3, n))
    for m in range(len(traced)):
        if forces[m] <= 0.0:
            continue
        for leg in range(traced[m] - 1):
            a, c = body[m, leg], body[m, leg + 1]
            if a == c or a < 0 or c < 0:
                continue
            p, q = trace[m, leg], trace[m, leg + 1]
            if a > c:
                a, c = c, a
                p, q = q, p
            d = q - p
            length = np.sqrt(d @ d)
            u = d / length
            across[:] = 0.0
            for k in range(c):
                r = d if k < a else q - centres[k]
                at = 6 * k
                across[0, at + 1], across[0, at + 2] = r[2], -r[1]
                across[1, at], across[1, at + 2] = -r[2], r[0]
                across[2, at], across[2, at + 1] = r[1], -r[0]
                if k >= a:
                    for i in range(3):
                        across[i, at + 3 + i] = 1.0
            for i in range(6 * c):
                along = u[0] * across[0, i] + u[1] * across[1, i] + u[2] * across[2, i]
                for j in range(3):
                    across[j, i] -= along * u[j]
            tension = forces[m] / length
            for i in range(6 * c):
                for j in range(6 * c):
                    found[i, j] += tension * (
                        across[0, i] * across[0, j]
                        + across[1, i] * across[1, j]
                        + across[2, i] * across[2, j]
                    )
    return found
