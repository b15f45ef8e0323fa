"""What bends a trunk: torques of a controller, or muscles over several joints."""

import mujoco
import numpy as np

from tests.generators.tracking.engine import STEP_S
from tests.generators.tracking.laws import Array

LARGEST_DEG = {"flexion_extension": -48.0, "lateral_bending": 24.0, "stance": 0.0}
"""Of T1 against the pelvis: forwards is negative, to the right positive."""

FURTHER = {"flexion_extension": 0.75, "lateral_bending": 0.65, "stance": 1.0}
"""What muscles are told, for their trunks to bend about as far as wanted: weight bends further."""

EVERY = 4
"""Steps of the engine after which muscles are told new lengths."""


def _axis(kind: str) -> int:
    return 1 if kind == "lateral_bending" else 0


class Torques:
    """A controller of the whole bend, with torques at all joints that carry most of the weight.

    Joints are also stiffened while the trunk works: both sides pull together.
    """

    def __init__(self, kind: str, rng: np.random.Generator) -> None:
        self.wanted = np.deg2rad(LARGEST_DEG[kind] * rng.uniform(0.9, 1.1))
        self.axis = _axis(kind)
        self.weights = rng.lognormal(0.0, 0.25, 17)
        self.carried = rng.uniform(0.85, 1.0, 17)
        self.together = rng.uniform(5.0, 20.0, 17)
        self.sum = 0.0

    def __call__(self, data: mujoco.MjData, share: float) -> Array:
        """(17, 6) N and N m at the joints, share of the whole bend being wanted."""
        q, speed = data.qpos[6:].reshape(17, 6), data.qvel[6:].reshape(17, 6)
        found = np.zeros((17, 6))
        found[:, 3:] = self.carried[:, None] * data.qfrc_bias[6:].reshape(17, 6)[:, 3:]
        found[:, 3:] -= self.together[:, None] * (0.3 + abs(share)) * q[:, 3:]
        off = self.wanted * share - q[:, 3 + self.axis].sum()
        self.sum += STEP_S * off
        pull = 60.0 * off + 60.0 * self.sum - 2.0 * speed[:, 3 + self.axis].sum()
        found[:, 3 + self.axis] += self.weights * pull
        for other in range(3):
            if other != self.axis:
                found[:, 3 + other] -= 30.0 * q[:, 3 + other].sum()
        return found


class Muscles:
    """Muscles over several joints, each pulling towards the length it is meant to have.

    Lengths are those of a posture in which the joints share the bend, which nobody corrects: weight
    bends the trunk further, and what is stiff less.
    """

    def __init__(self, model: mujoco.MjModel, kind: str, rng: np.random.Generator) -> None:
        self.model, self.axis = model, _axis(kind)
        self.wanted = FURTHER[kind] * np.deg2rad(LARGEST_DEG[kind] * rng.uniform(0.9, 1.1))
        share = np.array([0.16, 0.17, 0.16, 0.14, 0.12, 0.08, *[0.17 / 11] * 11])
        share *= rng.lognormal(0.0, 0.2, 17)
        self.share = share / share.sum()
        self.stiff = rng.uniform(1.5e4, 3.0e4, model.ntendon)
        self.tone = rng.uniform(5.0, 25.0, model.ntendon)
        self.meant = mujoco.MjData(model)
        self.calls = 0

    def __call__(self, data: mujoco.MjData, share: float) -> Array:
        """(17, 6) N and N m at the joints, share of the whole bend being wanted."""
        self._told(share)
        off = data.ten_length - self.meant.ten_length
        force = np.maximum(self.tone + self.stiff * off, 0.0)
        found: Array = -(force @ self._arms(data))[6:].reshape(17, 6)
        return found

    def _told(self, share: float) -> None:
        """Lengths that are meant."""
        if self.calls % EVERY == 0:
            meant = self.meant.qpos[6:].reshape(17, 6)
            meant[:, 3 + self.axis] = self.wanted * share * self.share
            mujoco.mj_kinematics(self.model, self.meant)
            mujoco.mj_comPos(self.model, self.meant)
            mujoco.mj_tendon(self.model, self.meant)
        self.calls += 1

    def _arms(self, data: mujoco.MjData) -> Array:
        """(muscles, 108) lever arms."""
        m = self.model
        found = np.zeros((m.ntendon, m.nv))
        mujoco.mju_sparse2dense(found, data.ten_J, m.ten_J_rownnz, m.ten_J_rowadr, m.ten_J_colind)
        return found
