"""Loads that a motion asks of the joints, and their slopes; pinocchio does the mechanics.

Generalised forces belong to the coordinates: a load on `extension` is the moment about the axis of
that rotation. Six joints of one coordinate stand for each of ours, so that they are the same.
"""

from functools import lru_cache

import numpy as np
import pinocchio as pin
from numba import njit

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.motion.points import COUNT
from spinepipe.motion.skeleton import BODIES, Skeleton
from spinepipe.units import STANDARD_GRAVITY

_JOINTS = (
    *(pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
    *(pin.JointModelRZ, pin.JointModelRX, pin.JointModelRY),
)


class RigidBodies:
    """The bodies of a skeleton, moving.

    Parameters
    ----------
    weight : whether gravity pulls.
    """

    def __init__(self, skeleton: Skeleton, weight: bool = True) -> None:
        self._model = _model_of(skeleton)
        self._model.gravity.linear = np.asarray(STANDARD_GRAVITY) if weight else np.zeros(3)
        self._data = self._model.createData()

    def loads(self, q: Array, velocity: Array, acceleration: Array) -> Array:
        """(F, 108) N and N m that hold and move the bodies, of postures (F, 108)."""
        return np.array(
            [
                pin.rnea(self._model, self._data, *now)
                for now in zip(q, velocity, acceleration, strict=True)
            ]
        )

    def with_slopes(self, q: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Loads (F, 108), and slopes (F, 3, 108, 108) by places, velocities and accelerations."""
        loads = np.empty((len(q), COUNT))
        slopes = np.empty((len(q), 3, COUNT, COUNT))
        for k, now in enumerate(zip(q, velocity, acceleration, strict=True)):
            pin.computeRNEADerivatives(self._model, self._data, *now)
            loads[k] = self._data.tau
            slopes[k, 0], slopes[k, 1] = self._data.dtau_dq, self._data.dtau_dv
            slopes[k, 2] = self._data.M
        _mirror(slopes[:, 2])
        return loads, slopes


@njit(cache=True)
def _mirror(matrices: Array) -> None:
    """Below their diagonals what is above: pinocchio writes one half of an inertia matrix."""
    for k in range(len(matrices)):
        for i in range(len(matrices[k])):
            for j in range(i):
                matrices[k, i, j] = matrices[k, j, i]


@lru_cache(maxsize=8)
def bodies_of(skeleton: Skeleton, weight: bool = True) -> RigidBodies:
    """The bodies of a skeleton, made once: making them takes as long as fifty postures."""
    return RigidBodies(skeleton, weight)


def _model_of(skeleton: Skeleton) -> pin.Model:
    model = pin.Model()
    parent = 0
    for body, name in enumerate(BODIES):
        placed = _placement(skeleton.steps[body - 1]) if body else pin.SE3.Identity()
        for k, joint in enumerate(_JOINTS):
            here = placed if k == 0 else pin.SE3.Identity()
            parent = model.addJoint(parent, joint(), here, f"{name}_{k}")
        masses = skeleton.masses
        inertia = pin.Inertia(
            float(masses.kg[body]), masses.com[body].copy(), masses.about_com[body].copy()
        )
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    return model


def _placement(pose: Pose) -> pin.SE3:
    return pin.SE3(np.asarray(pose.rotation, dtype=float), np.asarray(pose.origin, dtype=float))
