"""The chain in pinocchio: six single-axis joints per level, exact rigid-body terms."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from .chain import Chain
from .newton import root

Array = NDArray[np.float64]

AXES = (
    (pin.JointModelPX, "anterior"),
    (pin.JointModelPY, "superior"),
    (pin.JointModelPZ, "right"),
    (pin.JointModelRZ, "extension"),
    (pin.JointModelRX, "right_bending"),
    (pin.JointModelRY, "left_rotation"),
)


@dataclass(frozen=True)
class PinocchioChain:
    """A pinocchio model; velocities and positions are both (6J,) in the chain's own order."""

    chain: Chain
    model: pin.Model
    data: pin.Data

    def gravity_load(self, q: Array) -> Array:
        """Generalised load (6J,) that holds pose q against gravity."""
        return pin.computeGeneralizedGravity(self.model, self.data, np.ravel(q)).copy()

    def mass_matrix(self, q: Array) -> Array:
        """Symmetric mass matrix (6J, 6J)."""
        upper = np.triu(pin.crba(self.model, self.data, np.ravel(q)))
        return upper + np.triu(upper, 1).T

    def bias(self, q: Array, qd: Array) -> Array:
        """Coriolis, centrifugal and gravity load (6J,)."""
        return pin.nonLinearEffects(self.model, self.data, np.ravel(q), np.ravel(qd)).copy()

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Generalised load (6J,) for a motion, without bushings or loads."""
        arguments = (np.ravel(q), np.ravel(qd), np.ravel(qdd))
        return pin.rnea(self.model, self.data, *arguments).copy()

    def point_jacobian(self, q: Array, body: int, point: Array) -> Array:
        """(6, 6J): linear then angular velocity, ground axes, of a point given when neutral (m)."""
        joint = 6 * (body + 1)
        jacobian = pin.computeJointJacobians(self.model, self.data, np.ravel(q))
        jacobian = pin.getJointJacobian(
            self.model, self.data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        ).copy()
        arm = self.data.oMi[joint].rotation @ self._in_joint_frame(body, point)
        jacobian[:3] -= pin.skew(arm) @ jacobian[3:]
        return jacobian

    def point_position(self, q: Array, body: int, point: Array) -> Array:
        """Where a point given when neutral is in pose q: (3,) m in ground."""
        pin.forwardKinematics(self.model, self.data, np.ravel(q))
        return self.data.oMi[6 * (body + 1)].act(self._in_joint_frame(body, point))

    def residual(self, q: Array, factor: float = 1.0) -> Array:
        """Generalised load (6J,) missing for equilibrium; ``factor`` scales the chain's loads."""
        missing = self.chain.stiffness.ravel() * np.ravel(q) + self.gravity_load(q)
        for load in self.chain.loads:
            wrench = np.concatenate([load.force, load.moment])
            missing -= factor * self.point_jacobian(q, load.body, load.point).T @ wrench
        return missing

    def _in_joint_frame(self, body: int, point: Array) -> Array:
        return self.chain.rotations[body].T @ (np.asarray(point) - self.chain.origins[body])


def build(chain: Chain) -> PinocchioChain:
    """Build the model; body i hangs on the last of the six joints of level i."""
    model = pin.Model()
    model.gravity.linear = np.array(chain.gravity)
    below, joint = pin.SE3.Identity(), 0
    for level in range(chain.n_joints):
        frame = pin.SE3(chain.rotations[level], chain.origins[level])
        placement = below.actInv(frame)
        for joint_type, name in AXES:
            joint = model.addJoint(joint, joint_type(), placement, f"{name}_{level}")
            placement = pin.SE3.Identity()
        model.appendBodyToJoint(joint, _inertia(chain, level), pin.SE3.Identity())
        below = frame
    return PinocchioChain(chain, model, model.createData())


def equilibrium(chain: Chain, tol: float = 1e-12) -> Array:
    """Static pose (J, 6) of the chain under its loads."""
    peer = build(chain)
    return root(peer.residual, np.zeros(peer.model.nq), tol).reshape(-1, 6)


def _inertia(chain: Chain, body: int) -> pin.Inertia:
    axes = chain.rotations[body]
    centre = axes.T @ (chain.centres[body] - chain.origins[body])
    return pin.Inertia(chain.masses[body], centre, axes.T @ chain.inertias[body] @ axes)
