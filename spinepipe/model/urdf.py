"""A spine model as URDF for PyBullet: six single-axis joints per level, mass on the sixth link."""

from collections.abc import Iterable
from itertools import pairwise
from math import atan2, hypot

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model.spine import Body, SpineModel
from spinepipe.units import COORDINATES

AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 1", "1 0 0", "0 1 0")
"""Axis of each coordinate: translations x, y, z, then the rotations z, x', y''."""

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
    """Mass and inertia in the axes of the joint frame that carries the body."""
    inertia = (frame.rotation.T @ body.inertia @ frame.rotation).tolist()
    com = Pose(np.eye(3), frame.inverse().apply(body.com))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    return [
        "<inertial>",
        _origin(com),
        f'<mass value="{float(body.mass)!r}"/>',
        f'<inertia ixx="{xx!r}" iyy="{yy!r}" izz="{zz!r}" ixy="{xy!r}" ixz="{xz!r}" iyz="{yz!r}"/>',
        "</inertial>",
    ]


def _origin(pose: Pose) -> str:
    if pose is IDENTITY:
        return '<origin xyz="0 0 0" rpy="0 0 0"/>'
    return (
        f'<origin xyz="{_numbers(pose.origin)}" rpy="{_numbers(_roll_pitch_yaw(pose.rotation))}"/>'
    )


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """URDF's angles in rad: ``R = Rz(yaw) Ry(pitch) Rx(roll)``."""
    (xx, _, _), (yx, _, _), (zx, zy, zz) = rotation.tolist()
    return atan2(zy, zz), atan2(-zx, hypot(zy, zz)), atan2(yx, xx)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
