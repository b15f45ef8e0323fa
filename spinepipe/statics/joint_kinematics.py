"""Where the joint laws act: the geometry effects of a model composed, with their derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from spinepipe.effects import Effect, GeometryEffect
from spinepipe.effects.contract import Array, Indices

NOTHING = np.empty(0)


E = TypeVar("E", bound=Effect)


@dataclass(frozen=True)
class Active(Generic[E]):
    """An effect at work: its place in the model's effects, its joints and values."""

    effect: E
    index: int
    joints: Indices
    values: Array
    per_joint: bool

    @cached_property
    def rows(self) -> Indices | slice:
        """Its joints; as a slice where they follow each other, so that no row is copied."""
        joints = self.joints
        if len(joints) and (np.diff(joints) == 1).all():
            return slice(int(joints[0]), int(joints[-1]) + 1)
        return joints


@dataclass(frozen=True)
class JointKinematics:
    """Coordinates the laws see, and how they follow the joint's own; J joints.

    Attributes
    ----------
    q : (J, 6). by_coordinate : (J, 6, 6). by_coordinates : (J, 6, 6, 6).
    by_parameter : effect index to ``(dq (J, 6, R, P), dD (J, 6, 6, R, P))``.
    """

    q: Array
    by_coordinate: Array
    by_coordinates: Array
    by_parameter: dict[int, tuple[Array, Array]]

    @classmethod
    def unmoved(cls, q: Array) -> "JointKinematics":
        """The joints' own coordinates (J, 6), where no geometry effect is at work."""
        return cls(q, NOTHING, NOTHING, {})


def place(
    q: Array, geometry: Sequence[Active[GeometryEffect]], by_parameters: bool
) -> JointKinematics:
    """Compose the geometry effects at joint coordinates q (J, 6), in the model's order."""
    n = len(q)
    placed = JointKinematics(q.copy(), np.tile(np.eye(6), (n, 1, 1)), np.zeros((n, 6, 6, 6)), {})
    for active in geometry:
        placed = _then(placed, active, by_parameters)
    return placed


def _then(
    before: JointKinematics, active: Active[GeometryEffect], by_parameters: bool
) -> JointKinematics:
    """One more geometry effect after those already placed (chain rule to second order)."""
    j = active.joints
    step = active.effect.place(before.q[j], active.values)
    q, first, second = before.q.copy(), before.by_coordinate.copy(), before.by_coordinates.copy()
    q[j] = step.q
    first[j] = step.by_coordinate @ before.by_coordinate[j]
    # second derivative of a composition g(f(q)): f' g'' f' + g' f''
    slope, bent = before.by_coordinate[j][:, None], before.by_coordinates[j]
    with np.errstate(over="ignore", invalid="ignore"):  # steps that run away are given up later
        second[j] = np.swapaxes(slope, 2, 3) @ step.by_coordinates @ slope
        second[j] += (step.by_coordinate @ bent.reshape(len(j), 6, 36)).reshape(bent.shape)
    by_parameter = {}
    if by_parameters:
        # those of earlier effects go through this placement, then come this one's own
        for index, (dq_before, dfirst_before) in before.by_parameter.items():
            dq, dfirst = dq_before.copy(), dfirst_before.copy()
            dfirst[j] = np.einsum(
                "jkab,jbrp,jac->jkcrp", step.by_coordinates, dq[j], before.by_coordinate[j]
            ) + np.einsum("jka,jacrp->jkcrp", step.by_coordinate, dfirst[j])
            dq[j] = np.einsum("jka,jarp->jkrp", step.by_coordinate, dq[j])
            by_parameter[index] = dq, dfirst
        by_parameter[active.index] = _own(before, active)
    return JointKinematics(q, first, second, by_parameter)


def _own(before: JointKinematics, active: Active[GeometryEffect]) -> tuple[Array, Array]:
    """Derivatives by the effect's own parameters: a row per joint in scope, or one for all."""
    n, (rows, columns) = len(before.q), active.values.shape
    own = active.effect.by_parameter(before.q[active.joints], active.values)
    dq, dfirst = np.zeros((n, 6, rows, columns)), np.zeros((n, 6, 6, rows, columns))
    for number, joint in enumerate(active.joints):
        row = number if active.per_joint else 0
        dq[joint, :, row] = own.q[number]
        dfirst[joint, :, :, row] = np.einsum(
            "kap,ac->kcp", own.by_coordinate[number], before.by_coordinate[joint]
        )
    return dq, dfirst
