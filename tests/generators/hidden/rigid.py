"""The rigid spine in OpenSim: where its bodies are, and how loads on them reach the coordinates.

OpenSim gives poses and the system Jacobian. The loads' tangent follows from the same Jacobian:
for columns v_i (linear) and a_i (angular) of a serial chain,
d v_i / d q_j = a_min(i,j) x v_max(i,j), and d a_i / d q_j = a_j x a_i for j < i.
It steers Newton only; what is solved is the Jacobian's.
"""

from dataclasses import dataclass

import numpy as np
import opensim

from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import WEIGHTLESS, Chain

from .anatomy import Bones


@dataclass(frozen=True)
class Wrenches:
    """W forces on material points, and their derivatives if they turn with the spine.

    Attributes
    ----------
    bodies : (W,) indices. points : (W, 3) m, ground, where they are now. forces, moments : (W, 3).
    by_q : (W, 3, n) derivative of the forces, or None for forces fixed in ground.
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
    turns, places : (B, 3, 3) and (B, 3); a neutral point p is now at ``turns @ p + places``.
    linear, angular : (B, n, 3) velocity of the body's point ``places`` and of the body, per rate.
    """

    turns: np.ndarray
    places: np.ndarray
    linear: np.ndarray
    angular: np.ndarray

    def point(self, bodies: np.ndarray, neutral: np.ndarray) -> np.ndarray:
        """(W, 3) m where neutral points (W, 3) are now."""
        return np.einsum("wij,wj->wi", self.turns[bodies], neutral) + self.places[bodies]

    def velocities(self, bodies: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(W, n, 3) velocity per coordinate rate of points (W, 3) given where they are now."""
        arms = points - self.places[bodies]
        return self.linear[bodies] + self.angular[bodies] @ skew(arms)

    def applied(self, wrenches: Wrenches) -> tuple[np.ndarray, np.ndarray]:
        """Generalised load (n,) of the wrenches and its tangent (n, n)."""
        v = self.velocities(wrenches.bodies, wrenches.points)
        a = self.angular[wrenches.bodies]
        axes = self.angular[-1]
        load, pulls = _along_and_across(v, wrenches.forces)
        turning, twists = _along_and_across(a, wrenches.moments)
        before = np.tri(len(load), k=-1)
        by_max = axes @ pulls.T
        by_lower = by_max.T + twists @ axes.T
        tangent = by_max + before * (by_lower - by_max)
        if wrenches.by_q is not None:
            tangent += np.einsum("wni,wim->nm", v, wrenches.by_q)
        return load + turning, tangent


class Spine:
    """One specimen's rigid bodies and joints in OpenSim, without springs, loads or weight."""

    def __init__(self, bones: Bones) -> None:
        free = np.zeros((len(bones.masses), 6))
        self._built = opensim_peer.build(
            Chain(**vars(bones), stiffness=free, damping=free, gravity=WEIGHTLESS)
        )
        model = self._built.model
        self._bodies = [model.getBodySet().get(b) for b in range(len(bones.masses))]
        self._matter = model.getMatterSubsystem()
        self._rows = [b.getMobilizedBodyIndex() for b in self._bodies]

    def at(self, q: np.ndarray) -> Pose:
        """The pose at q (J, 6)."""
        built = self._built
        opensim_peer._set_q(built, q.ravel())
        built.model.realizePosition(built.state)
        matrix = opensim.Matrix()
        self._matter.calcSystemJacobian(built.state, matrix)
        jacobian = matrix.to_numpy().reshape(-1, 6, q.size)[self._rows][..., built.slots]
        frames = [body.getTransformInGround(built.state) for body in self._bodies]
        turns = np.array([_matrix(frame.R().asMat33()) for frame in frames])
        places = np.array([frame.p().to_numpy() for frame in frames])
        columns = np.swapaxes(jacobian, 1, 2)
        return Pose(turns, places, columns[..., 3:], columns[..., :3])


def skew(b: np.ndarray) -> np.ndarray:
    """(..., 3, 3) with ``a @ skew(b) == a x b`` for rows a."""
    matrix = np.zeros((*b.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -b[..., 2], b[..., 1], -b[..., 0]
    return matrix - np.swapaxes(matrix, -1, -2)


def together(wrenches: list[Wrenches]) -> Wrenches:
    """All wrenches in one."""
    parts = ("bodies", "points", "forces", "moments")
    joined = (np.concatenate([getattr(w, part) for w in wrenches]) for part in parts)
    turning = [w for w in wrenches if w.by_q is not None]
    if not turning:
        return Wrenches(*joined)
    n = turning[0].by_q.shape[-1]
    fixed = [np.zeros((len(w.bodies), 3, n)) if w.by_q is None else w.by_q for w in wrenches]
    return Wrenches(*joined, np.concatenate(fixed))


def _along_and_across(columns: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums over W of columns (W, n, 3) times and cross vectors (W, 3): (n,) and (n, 3)."""
    both = np.concatenate([vectors[:, :, None], skew(vectors)], axis=-1)
    found = (columns @ both).sum(axis=0)
    return found[:, 0], found[:, 1:]


def _matrix(values: opensim.Mat33) -> list[list[float]]:
    return [[values.get(i, j) for j in range(3)] for i in range(3)]
