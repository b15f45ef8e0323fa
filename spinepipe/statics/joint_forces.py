"""What the joints hold: the joint and path laws of a model summed, with all derivatives.

Laws act in the model's order; a law may depend on the load of those before it (``carried``), so
derivatives of earlier laws pass through later ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Advance, JointLaw, JointResponse, PathLaw
from spinepipe.effects.contract import Array
from spinepipe.statics.joint_kinematics import Active, JointKinematics


@dataclass(frozen=True)
class States:
    """Internal states of the path laws during one load step.

    Attributes
    ----------
    of : (J, S) state of each path law as the last step left it, by its place in the effects.
    seconds : duration of the step; zero where the test records no time. Where steps of several
        tests are solved at once, (J,) for the joints of each path law, by its place.
    """

    of: Mapping[int, Array]
    seconds: float | Mapping[int, Array] = 0.0

    def step_seconds(self, law: int) -> float | Array:
        """Duration of the step, for a path law; of each of its joints where these differ."""
        return self.seconds[law] if isinstance(self.seconds, Mapping) else self.seconds


NO_STATES = States({})


@dataclass(frozen=True)
class ActiveLaw(Active[JointLaw]):
    """A joint law at work."""

    def respond(self, q: Array, carried: Array, states: States) -> JointResponse:
        """Response of the joints in scope."""
        return self.effect.respond(q, self.values, carried)

    def by_parameter(self, q: Array, carried: Array, states: States) -> Array:
        """(J, 6, P) derivative by the parameters of each joint in scope."""
        return self.effect.by_parameter(q, self.values, carried)


@dataclass(frozen=True)
class ActivePath(Active[PathLaw]):
    """A path law at work; it responds with the state that the last load step left."""

    def respond(self, q: Array, carried: Array, states: States) -> JointResponse:
        """Response of the joints in scope."""
        return self.effect.respond_on_path(
            q, self.values, states.of[self.index], states.step_seconds(self.index), carried
        )

    def by_parameter(self, q: Array, carried: Array, states: States) -> Array:
        """(J, 6, P) derivative by the parameters of each joint in scope."""
        return self.effect.by_parameter_on_path(
            q, self.values, states.of[self.index], states.step_seconds(self.index), carried
        )

    def by_state(self, q: Array, carried: Array, states: States) -> Array:
        """(J, 6, S) derivative by the state of each joint in scope."""
        return self.effect.by_state(
            q, self.values, states.of[self.index], states.step_seconds(self.index), carried
        )

    def advance(self, q: Array, carried: Array, states: States) -> Advance:
        """State of the joints in scope after a step that ended at q (J, 6)."""
        return self.effect.advance(
            q, self.values, states.of[self.index], states.step_seconds(self.index), carried
        )


Law = ActiveLaw | ActivePath


@dataclass(frozen=True)
class JointForces:
    """Generalised load (J, 6) that holds the joints and its tangent blocks (J, 6, 6)."""

    load: Array
    tangent: Array


def assemble_joint_forces(
    kinematics: JointKinematics, laws: Sequence[Law], states: States, moved: bool
) -> JointForces:
    """Sum of the laws, pulled back to the joints' own coordinates where geometry moved them."""
    load, tangent = np.zeros_like(kinematics.q), np.zeros((*kinematics.q.shape, 6))
    for law in laws:
        j = law.rows
        response = law.respond(kinematics.q[j], load[j], states)
        if response.by_carried is not None:  # by the chain rule, of what those before it hold
            tangent[j] += response.by_carried @ tangent[j]
        tangent[j] += response.tangent
        load[j] += response.load
    if not moved:
        return JointForces(load, tangent)
    # virtual work: with s(q) what the laws see, the load is s' F, its slope s' K s' + s'' F
    first = kinematics.by_coordinate
    pulled = np.einsum("jka,jk->ja", first, load)
    stiff = np.einsum("jka,jkl,jlb->jab", first, tangent, first)
    return JointForces(pulled, stiff + np.einsum("jk,jkab->jab", load, kinematics.by_coordinates))


def states_after(q: Array, laws: Sequence[Law], states: States) -> dict[int, Advance]:
    """States of the path laws after a step that ended where the laws see q (J, 6), by index."""
    load, advances = np.zeros_like(q), {}
    for law in laws:
        j = law.joints
        if isinstance(law, ActivePath):
            advances[law.index] = law.advance(q[j], load[j], states)
        load[j] += law.respond(q[j], load[j], states).load
    return advances


@dataclass(frozen=True)
class JointForceDerivatives:
    """Derivatives of the holding load at fixed coordinates.

    Attributes
    ----------
    by_parameter : effect index to (J, 6, R, P). by_state : path law index to (J, 6, R, S).
    """

    by_parameter: dict[int, Array]
    by_state: dict[int, Array]


def differentiate_joint_forces(
    kinematics: JointKinematics, laws: Sequence[Law], states: States
) -> JointForceDerivatives:
    """Derivatives by every parameter and internal state, geometry effects included."""
    load, tangent = np.zeros_like(kinematics.q), np.zeros((*kinematics.q.shape, 6))
    by_parameter: dict[int, Array] = {}
    by_state: dict[int, Array] = {}
    for law in laws:
        j, here, carried = law.joints, kinematics.q[law.joints], load[law.joints]
        response = law.respond(here, carried, states)
        if response.by_carried is not None:
            # earlier laws' derivatives also act through one that reads the carried load
            for earlier in (*by_parameter.values(), *by_state.values()):
                earlier[j] += np.einsum("jkl,jlrp->jkrp", response.by_carried, earlier[j])
            tangent[j] += response.by_carried @ tangent[j]
        own = _spread(law, law.by_parameter(here, carried, states), len(load))
        by_parameter[law.index] = own if law.per_joint else own.sum(axis=2, keepdims=True)
        if isinstance(law, ActivePath):
            own = law.by_state(here, carried, states)
            by_state[law.index] = _spread(law, own, len(load))
        tangent[j] += response.tangent
        load[j] += response.load
    pull = kinematics.by_coordinate
    by_parameter = {i: np.einsum("jka,jkrp->jarp", pull, d) for i, d in by_parameter.items()}
    by_state = {i: np.einsum("jka,jkrp->jarp", pull, d) for i, d in by_state.items()}
    for index, (dq, dfirst) in kinematics.by_parameter.items():
        by_parameter[index] = np.einsum("jkarp,jk->jarp", dfirst, load) + np.einsum(
            "jka,jkl,jlrp->jarp", pull, tangent, dq
        )
    return JointForceDerivatives(by_parameter, by_state)


def _spread(law: Law, own: Array, n_joints: int) -> Array:
    """(J, 6, R, P) from (R, 6, P): each joint in scope has its own row of parameters."""
    spread = np.zeros((n_joints, 6, len(law.joints), own.shape[2]))
    rows = np.arange(len(law.joints))
    spread[law.joints, :, rows] = own
    return spread
