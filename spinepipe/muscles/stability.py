"""Whether a held posture stands still when it is pushed a little, or with how much co-contraction.

The spine may turn and move at all seven joints: 42 coordinates, each a small turn or move of all
that is above a joint. The stiffness against them is that of the joints, of the muscles (short-range
stiffness: q times force over length, and the slope of what is stretched), and of all forces that
change their lever arms, pulls and weights alike. Where the smallest eigenvalue is negative the
posture falls over, and more tone is needed (Bergmark 1989). Contacts of fascicles and arms are
taken as fixed to the bodies, and pulls on the rectus sheath as dead loads.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, solve_task
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.status import Balanced

LENGTH_M = 0.05
"""Makes moves comparable with turns: a move of so much counts like a turn of 1 rad."""

LARGEST_TONE = 0.2
"""Up to which tone is looked for: every muscle at a fifth of its strength, beside the task."""

_N = 6 * len(LEVELS)
_FIRST, _HALVINGS = 0.00125, 6


@dataclass(frozen=True, eq=False)
class CoContraction:
    """A task solved with tone.

    Attributes
    ----------
    tone : least activation of every muscle, share of its largest.
    eigenvalue : N m/rad, below nought where the posture falls over.
    """

    solved: SolvedTask
    tone: float
    eigenvalue: float

    @property
    def stands(self) -> bool:
        """Whether it is held and does not fall over."""
        return self.solved.status is Balanced.CONVERGED and self.eigenvalue >= 0.0


def solve_with_tone(
    person: Person, task: Task, options: SolverOptions, gain: float, tone: float
) -> CoContraction:
    """The task with a tone; raises as `solve_task` does."""
    found = solve_task(person, task, options, tone)
    return CoContraction(found, tone, smallest_eigenvalue(person, found, gain))


def least_stable(
    person: Person, task: Task, options: SolverOptions, gain: float
) -> CoContraction | None:
    """The least tone that is stable, to a sixtieth of it; None where none is or can be held.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    none = solve_with_tone(person, task, options, gain, 0.0)
    if none.stands:
        return none
    # doubled until it stands or cannot be held, then bisected: more tone can be too much to hold
    low, high, best = 0.0, _FIRST, None
    while best is None:
        now = solve_with_tone(person, task, options, gain, high)
        if now.stands:
            best = now
        elif now.solved.status is not Balanced.CONVERGED:
            break
        elif high == LARGEST_TONE:
            return None
        else:
            low, high = high, min(2.0 * high, LARGEST_TONE)
    for _ in range(_HALVINGS):
        middle = solve_with_tone(person, task, options, gain, 0.5 * (low + high))
        if middle.stands:
            high, best = middle.tone, middle
        elif middle.solved.status is Balanced.CONVERGED:
            low = middle.tone
        else:
            high = middle.tone
    return best


@dataclass(frozen=True, eq=False)
class _Lines:
    """L straight pieces of fascicles that pull, from one body to another.

    Attributes
    ----------
    at : (L, 2, 3) m, ends. on : (L, 2) their bodies. pull : (L, 3) N on the first, towards the
        second.
    """

    at: Array
    on: NDArray[np.int64]
    pull: Array


def smallest_eigenvalue(person: Person, solved: SolvedTask, gain: float) -> float:
    """N m/rad; below nought the posture falls over.

    Parameters
    ----------
    gain : q of a muscle's stiffness q force / length.
    """
    scale = np.tile([1.0, 1.0, 1.0, *[LENGTH_M] * 3], len(LEVELS))
    matrix = stiffness(person, solved, gain) * np.outer(scale, scale)
    return float(eigh(0.5 * (matrix + matrix.T))[0][0])


def stiffness(person: Person, solved: SolvedTask, gain: float) -> Array:
    """(42, 42) N m/rad, N/rad and N/m: turns (3) and moves (3) in ground axes, joint by joint.

    The second derivative of energy: material stiffness of muscles and joints, and the geometric
    stiffness of all forces that act while their points move.
    """
    muscles, pulls = person.lines.trunk.muscles, solved.pulls
    forces = solved.found.forces
    # how fast each fascicle shortens with every coordinate: its lever arms, and what it draws at
    arms = solved.demand.arms.T.reshape(len(muscles), -1, 3)
    drawn = np.cumsum(pulls.forces[:, :0:-1], axis=1)[:, ::-1]
    slopes = np.concatenate([arms, drawn], axis=2).reshape(len(muscles), _N)
    strength = solved.demand.most - solved.stretched
    rising = person.passive.slopes(pulls.lengths, person.rest, person.fibres, strength)
    found: Array = slopes.T @ ((gain * forces / pulls.lengths + rising)[:, None] * slopes)
    found += joint_stiffness(person, solved)
    lines = _pulling_lines(solved)
    tensors, weights = _tensors(solved, lines)
    found += _changing_arms(tensors, weights)
    found += _turning_lines(lines, solved.poses.centres)
    return found


def joint_stiffness(person: Person, solved: SolvedTask) -> Array:
    """(42, 42) stiffness of the joints by themselves, block by block."""
    found = np.zeros((_N, _N))
    turning = person.laws.slopes(solved.poses.turned, solved.compression)
    for level, disc in enumerate(solved.poses.discs):
        at = 6 * level
        found[at : at + 3, at : at + 3] = disc @ np.diag(turning[level]) @ disc.T
        moving = np.diag(
            [person.laws.shear[level, 0], person.laws.axial[level], person.laws.shear[level, 1]]
        )
        found[at + 3 : at + 6, at + 3 : at + 6] = disc @ moving @ disc.T
    return found


def _tensors(solved: SolvedTask, lines: _Lines) -> tuple[Array, Array]:
    """Of all forces above each joint: (7, 3, 3) sum of arm times force, N m, and (7, 3) sum, N."""
    loads = solved.applied
    points = np.vstack([loads.at, lines.at[:, 0], lines.at[:, 1]])
    forces = np.vstack([loads.pushes, lines.pull, -lines.pull])
    bodies = np.concatenate([loads.bodies, lines.on[:, 0], lines.on[:, 1]])
    tensors, weights = np.zeros((len(LEVELS), 3, 3)), np.zeros((len(LEVELS), 3))
    for level, centre in enumerate(solved.poses.centres):
        above = bodies > level
        tensors[level] = (points[above] - centre).T @ forces[above]
        weights[level] = forces[above].sum(axis=0)
    return tensors, weights


def _changing_arms(tensors: Array, weights: Array) -> Array:
    """(42, 42) stiffness of forces that keep their direction while their points move.

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
        )  # cross @ v is force x v
        for lower in range(upper + 1):
            a, b = slice(6 * lower, 6 * lower + 3), slice(6 * upper, 6 * upper + 3)
            if lower == upper:
                # of two turns about one joint neither comes first: the mean of both orders
                found[a, a] += 0.5 * (turn + turn.T)
                continue
            found[a, b] += turn
            found[b, a] += turn.T
            move = slice(6 * upper + 3, 6 * upper + 6)
            found[a, move] += cross
            found[move, a] += cross.T
    return found


def _pulling_lines(solved: SolvedTask) -> _Lines:
    """Pieces of fascicles in tension; those between points of one body do nothing."""
    pulls, forces = solved.pulls, solved.found.forces
    first, second = pulls.on[:, :-1], pulls.on[:, 1:]
    there = np.arange(1, pulls.on.shape[1]) < pulls.traced[:, None]
    m, leg = np.nonzero(there & (first != second) & (forces > 0.0)[:, None])
    at = np.stack([pulls.trace[m, leg], pulls.trace[m, leg + 1]], axis=1)
    way = at[:, 1] - at[:, 0]
    tension = forces[m] / np.linalg.norm(way, axis=1)
    on = np.stack([first[m, leg], second[m, leg]], axis=1)
    return _Lines(at, on, tension[:, None] * way)


def _turning_lines(lines: _Lines, centres: Array) -> Array:
    """(42, 42) stiffness of strings under tension against being moved across their line: tension
    over length."""
    levels = np.arange(len(LEVELS))[:, None]
    low, high = np.sort(lines.on, axis=1).T
    order = np.argsort(lines.on, axis=1)[..., None]
    lower, upper = np.swapaxes(np.take_along_axis(lines.at, order, axis=1), 0, 1)
    way, length = upper - lower, np.linalg.norm(upper - lower, axis=1)
    # a joint below both ends turns the whole line, one between them its upper end alone
    below = levels < low
    arms = np.where(below[..., None], way, upper - centres[:, None])
    moved = np.zeros((len(LEVELS), 6, len(way), 3))
    moved[:, :3] = np.cross(np.eye(3)[:, None], arms[:, None])
    moved[:, 3:] = ~below[:, None, :, None] * np.eye(3)[:, None]
    moved *= (levels < high)[:, None, :, None]
    along = way / length[:, None]
    across = moved - np.einsum("...i,...i->...", moved, along)[..., None] * along
    tension = np.linalg.norm(lines.pull, axis=1) / length
    # tension over length times products of motions across, as a Gram matrix
    rows = (across * np.sqrt(tension)[:, None]).reshape(_N, -1)
    found: Array = rows @ rows.T
    return found
