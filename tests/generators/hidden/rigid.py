"""The rigid spine in closed form: where its bodies are, and how loads reach the coordinates.

Poses and Jacobians of a serial chain, for any number of states at once (leading axes ``...``);
tests/reference/test_hidden_data.py holds them against OpenSim. The loads' tangent follows from the
Jacobian: for columns v_i (linear) and a_i (angular) of a serial chain,
d v_i / d q_j = a_min(i,j) x v_max(i,j), and d a_i / d q_j = a_j x a_i for j < i.
"""

from dataclasses import dataclass

import numpy as np

from .anatomy import Bones
from .turns import matrices, rate_axes_zxy


@dataclass(frozen=True)
class Wrenches:
    """W forces on material points, and their derivatives if they turn with the spine.

    Attributes
    ----------
    bodies : (W,) indices. points : (..., W, 3) m, ground, where they are now.
    forces, moments : (..., W, 3).
    by_q : (..., W, 3, n) derivative of the forces, or None for forces fixed in ground.
    """

    bodies: np.ndarray
    points: np.ndarray
    forces: np.ndarray
    moments: np.ndarray
    by_q: np.ndarray | None = None


@dataclass(frozen=True)
class Pose:
    """The spine at some q; n = 6 J coordinates, B = J bodies.

    Attributes
    ----------
    turns, places : (..., B, 3, 3) and (..., B, 3); a neutral point p is now at
        ``turns @ p + places``.
    linear, angular : (..., B, n, 3) velocity of the body's point ``places`` and of the body, per
        rate.
    """

    turns: np.ndarray
    places: np.ndarray
    linear: np.ndarray
    angular: np.ndarray

    def point(self, bodies: np.ndarray, neutral: np.ndarray) -> np.ndarray:
        """(..., W, 3) m where neutral points (W, 3) are now."""
        turned = (self.turns[..., bodies, :, :] @ neutral[:, :, None])[..., 0]
        return turned + self.places[..., bodies, :]

    def velocities(self, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(..., W, n, 3) velocity per coordinate rate of points given where they are now."""
        arms = points - self.places[..., bodies, :]
        return self.linear[..., bodies, :, :] + self.angular[..., bodies, :, :] @ skew(arms)

    def applied(self, wrenches: Wrenches) -> tuple[np.ndarray, np.ndarray]:
        """Generalised load (..., n) of the wrenches and its tangent (..., n, n)."""
        v = self.velocities(wrenches.bodies, wrenches.points)
        a = self.angular[..., wrenches.bodies, :, :]
        axes = self.angular[..., -1, :, :]
        load, pulls = _along_and_across(v, wrenches.forces)
        turning, twists = _along_and_across(a, wrenches.moments)
        before = np.tri(load.shape[-1], k=-1)
        by_max = axes @ np.swapaxes(pulls, -1, -2)
        by_lower = np.swapaxes(by_max, -1, -2) + twists @ np.swapaxes(axes, -1, -2)
        tangent = by_max + before * (by_lower - by_max)
        if wrenches.by_q is not None:
            tangent = tangent + (v @ wrenches.by_q).sum(axis=-3)
        return load + turning, tangent


class Spine:
    """One specimen's rigid bodies and joints, without springs, loads or weight."""

    def __init__(self, bones: Bones) -> None:
        self.bones = bones

    def at(self, q: np.ndarray) -> Pose:
        """The pose at q (..., J, 6)."""
        bones, n_joints = self.bones, q.shape[-2]
        motions, axes_in = matrices(q), rate_axes_zxy(q)
        lead = q.shape[:-2]
        turn, place = np.broadcast_to(np.eye(3), (*lead, 3, 3)), np.zeros((*lead, 3))
        turns = np.empty((*lead, n_joints, 3, 3))
        places = np.empty((*lead, n_joints, 3))
        v, a = np.zeros((2, *lead, n_joints, 6 * n_joints, 3))
        centres = np.empty((*lead, n_joints, 3))
        for joint, (frame, origin) in enumerate(zip(bones.rotations, bones.origins, strict=True)):
            axes = turn @ frame
            centre = (turn @ origin) + place + (axes @ q[..., joint, :3, None])[..., 0]
            turn = axes @ motions[..., joint, :, :] @ frame.T
            place = centre - turn @ origin
            turns[..., joint, :, :], places[..., joint, :] = turn, place
            centres[..., joint, :] = centre
            shifts = slice(6 * joint, 6 * joint + 3)
            v[..., joint:, shifts, :] = np.swapaxes(axes, -1, -2)[..., None, :, :]
            about = np.swapaxes(axes @ axes_in[..., joint, :, :], -1, -2)
            a[..., joint:, 6 * joint + 3 : 6 * joint + 6, :] = about[..., None, :, :]
        for joint in range(n_joints):
            mine = slice(6 * joint + 3, 6 * joint + 6)
            arms = places[..., joint:, :] - centres[..., joint, None, :]
            v[..., joint:, mine, :] = a[..., joint:, mine, :] @ skew(arms)
        return Pose(turns, places, v, a)


def skew(vectors: np.ndarray) -> np.ndarray:
    """(..., 3, 3) with ``a @ skew(v) == a x v`` for rows a."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = ((zero, -z, y), (z, zero, -x), (-y, x, zero))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def together(wrenches: list[Wrenches]) -> Wrenches:
    """One list of all wrenches."""
    if len(wrenches) == 1:
        return wrenches[0]
    bodies = np.concatenate([w.bodies for w in wrenches])
    points, forces, moments = (
        np.concatenate([getattr(w, part) for w in wrenches], axis=-2)
        for part in ("points", "forces", "moments")
    )
    turning = [w for w in wrenches if w.by_q is not None]
    if not turning:
        return Wrenches(bodies, points, forces, moments)
    n = turning[0].by_q.shape[-1]
    parts = [np.zeros((*w.forces.shape, n)) if w.by_q is None else w.by_q for w in wrenches]
    return Wrenches(bodies, points, forces, moments, np.concatenate(parts, axis=-3))


def _along_and_across(columns: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums over W of columns (..., W, n, 3) times and cross vectors (..., W, 3)."""
    along = (columns @ vectors[..., None])[..., 0].sum(axis=-2)
    return along, (columns @ skew(vectors)).sum(axis=-3)
