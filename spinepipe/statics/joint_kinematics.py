"""Where the joint laws act: the geometry effects of a model composed, with their derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import GeometryEffect, Placement
from spinepipe.effects.contract import Array, Indices


@dataclass(frozen=True)
class ActiveGeometry:
    """A geometry effect at work: its place in the model's effects, its joints and values."""

    effect: GeometryEffect
    index: int
    joints: Indices
    values: Array
    per_joint: bool


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


def place(q: Array, geometry: Sequence[ActiveGeometry], by_parameters: bool) -> JointKinematics:
    """Compose the geometry effects at joint coordinates q (J, 6), in the model's order."""
    n = len(q)
    placed = JointKinematics(q.copy(), np.tile(np.eye(6), (n, 1, 1)), np.zeros((n, 6, 6, 6)), {})
    for active in geometry:
        placed = _then(placed, active, by_parameters)
    return placed


def _then(before: JointKinematics, active: ActiveGeometry, by_parameters: bool) -> JointKinematics:
    """One more geometry effect after those already placed (chain rule to second order)."""
    j = active.joints
    step = active.effect.place(before.q[j], active.values)
    q, first, second = before.q.copy(), before.by_coordinate.copy(), before.by_coordinates.copy()
    q[j] = step.q
    first[j] = step.by_coordinate @ before.by_coordinate[j]
    slope, bent = before.by_coordinate[j][:, None], before.by_coordinates[j]
    with np.errstate(over="ignore", invalid="ignore"):  # steps that run away are given up later
        second[j] = np.swapaxes(slope, 2, 3) @ step.by_coordinates @ slope
        second[j] += (step.by_coordinate @ bent.reshape(len(j), 6, 36)).reshape(bent.shape)
    by_parameter = {}
    if by_parameters:
        carried = before.by_parameter.items()
        by_parameter = {i: _push(before, j, step, pair) for i, pair in carried}
        by_parameter[active.index] = _own(before, active)
    return JointKinematics(q, first, second, by_parameter)


def _push(
    before: JointKinematics, j: Indices, step: Placement, pair: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Earlier effects' parameter derivatives carried through a later placement."""
    dq, dfirst = pair[0].copy(), pair[1].copy()
    dfirst[j] = np.einsum(
        "jkab,jbrp,jac->jkcrp", step.by_coordinates, dq[j], before.by_coordinate[j]
    ) + np.einsum("jka,jacrp->jkcrp", step.by_coordinate, dfirst[j])
    dq[j] = np.einsum("jka,jarp->jkrp", step.by_coordinate, dq[j])
    return dq, dfirst


def _own(before: JointKinematics, active: ActiveGeometry) -> tuple[Array, Array]:
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
