"""A spine model as URDF for PyBullet: six single-axis joints per level, mass on the sixth link."""

from collections.abc import Iterable
from itertools import pairwise
from math import atan2, cos, hypot, sin

import numpy as np

from spinepipe.decomposition import eigh
from spinepipe.frames import Pose
from spinepipe.model.spine import Body, SpineModel
from spinepipe.units import COORDINATES

AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 1", "1 0 0", "0 1 0")
"""Axis of each coordinate: translations x, y, z, then the rotations z, x', y''."""

INSIDE_LIMIT = 1e-12
"""A flat body has its largest moment at the sum of the others; rounding must not exceed it."""

IDENTITY = Pose(np.eye(3), np.zeros(3))


def urdf(model: SpineModel) -> str:
    """URDF text of the model, one element per line (PyBullet's parser loses long lines)."""
    lines = ['<robot name="spine">', '<link name="ground">', *_MASSLESS, "</link>"]
    for index, (lower, upper) in enumerate(pairwise((IDENTITY, *model.frames))):
        lines += _level(index, lower.inverse() @ upper, upper, model.bodies[index])
    return "\n".join([*lines, "</robot>", ""])


def _level(index: int, placed: Pose, frame: Pose, body: Body) -> list[str]:
    """The six links and joints of one level."""
    lines: list[str] = []
    parent = "ground" if index == 0 else f"j{index - 1}_{COORDINATES[5]}"
    for axis, coordinate in zip(AXES, COORDINATES, strict=True):
        child = f"j{index}_{coordinate}"
        lines += [f'<link name="{child}">']
        lines += _inertial(body, frame) if coordinate == COORDINATES[5] else _MASSLESS
        lines += ["</link>"]
        kind = "prismatic" if coordinate in COORDINATES[:3] else "revolute"
        lines += [
            f'<joint name="{child}" type="{kind}">',
            _origin(placed if coordinate == COORDINATES[0] else IDENTITY),
            f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>',
            '<limit lower="-100" upper="100" effort="1e9" velocity="1e9"/>',
            "</joint>",
        ]
        parent = child
    return lines


_MASSLESS = [
    "<inertial>",
    '<mass value="0"/>',
    '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>',
    "</inertial>",
]


def _inertial(body: Body, frame: Pose) -> list[str]:
    """Mass and principal inertia, placed in the joint frame that carries the body.

    PyBullet's own search for principal axes stops at 1e-8, so they are found here.
    """
    moments, axes = eigh(frame.rotation.T @ body.inertia @ frame.rotation)
    axes[:, 0] *= np.linalg.det(axes)
    xx, yy = moments[:2].tolist()
    zz = min(float(moments[2]), (xx + yy) * (1.0 - INSIDE_LIMIT))
    return [
        "<inertial>",
        _origin(Pose(axes, frame.inverse().apply(body.com))),
        f'<mass value="{float(body.mass)!r}"/>',
        f'<inertia ixx="{xx!r}" iyy="{yy!r}" izz="{zz!r}" ixy="0" ixz="0" iyz="0"/>',
        "</inertial>",
    ]


def _origin(pose: Pose) -> str:
    if pose is IDENTITY:
        return '<origin xyz="0 0 0" rpy="0 0 0"/>'
    # URDF's angles in rad: R = Rz(yaw) Ry(pitch) Rx(roll)
    (xx, xy, xz), (yx, yy, yz), (zx, _, _) = pose.rotation.tolist()
    yaw = atan2(yx, xx)
    roll = atan2(sin(yaw) * xz - cos(yaw) * yz, cos(yaw) * yy - sin(yaw) * xy)
    angles = (roll, atan2(-zx, hypot(xx, yx)), yaw)
    return f'<origin xyz="{_numbers(pose.origin)}" rpy="{_numbers(angles)}"/>'


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
