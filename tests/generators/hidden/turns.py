"""Rotations of joints as coordinates and back, and motion told from other frames. Vectorised."""

import numpy as np

BENDING_X, ROTATION_Y, EXTENSION_Z = 4, 5, 3


def matrices(q: np.ndarray) -> np.ndarray:
    """(..., 3, 3) ``Rz(extension) Rx(right_bending) Ry(left_rotation)`` of coordinates (..., 6)."""
    cz, cx, cy = np.moveaxis(np.cos(q[..., 3:]), -1, 0)
    sz, sx, sy = np.moveaxis(np.sin(q[..., 3:]), -1, 0)
    rows = (
        (cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy),
        (sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy),
        (-cx * sy, sx, cx * cy),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def coordinates(shift: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(..., 6) coordinates of a displacement (..., 3) and a rotation (..., 3, 3)."""
    extension = np.arctan2(-turn[..., 0, 1], turn[..., 1, 1])
    bending = np.arcsin(np.clip(turn[..., 2, 1], -1.0, 1.0))
    rotation = np.arctan2(-turn[..., 2, 0], turn[..., 2, 2])
    angles = np.stack([extension, bending, rotation], axis=-1)
    return np.concatenate([shift, angles], axis=-1)


def told_from(q: np.ndarray, tilts: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """The same motion (..., J, 6) told by someone whose joint frame is another.

    That frame stands at ``offsets`` (J, 3) m in the true one and is turned by ``tilts`` (J, 3, 3).
    """
    turn = matrices(q)
    shift = q[..., :3] + np.einsum("...ij,...j->...i", turn - np.eye(3), offsets)
    back = np.swapaxes(tilts, -1, -2)
    return coordinates(np.einsum("...ij,...j->...i", back, shift), back @ turn @ tilts)


def rate_axes_zxy(q: np.ndarray) -> np.ndarray:
    """(..., 3, 3) columns: axes about which extension, bending and rotation turn the joint."""
    cz, cx, _ = np.moveaxis(np.cos(q[..., 3:]), -1, 0)
    sz, sx, _ = np.moveaxis(np.sin(q[..., 3:]), -1, 0)
    zero, one = np.zeros_like(cz), np.ones_like(cz)
    columns = ((zero, zero, one), (cz, sz, zero), (-sz * cx, cz * cx, sx))
    return np.stack([np.stack(column, axis=-1) for column in columns], axis=-1)


def as_xyz(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates with X-Y-Z instead of Z-X-Y angles, and their derivative (..., J, 6, 6).

    The joint's rotation is ``Rx(right_bending) Ry(left_rotation) Rz(extension)`` there.
    """
    turn = matrices(q)
    x = np.arctan2(-turn[..., 1, 2], turn[..., 2, 2])
    y = np.arcsin(np.clip(turn[..., 0, 2], -1.0, 1.0))
    z = np.arctan2(-turn[..., 0, 1], turn[..., 0, 0])
    angles = np.stack([z, x, y], axis=-1)
    zero, one = np.zeros_like(x), np.ones_like(x)
    about_x, about_y = (one, zero, zero), (zero, np.cos(x), np.sin(x))
    about_z = (np.sin(y), -np.sin(x) * np.cos(y), np.cos(x) * np.cos(y))
    axes = np.stack([np.stack(a, axis=-1) for a in (about_z, about_x, about_y)], axis=-1)
    derivative = np.zeros((*q.shape, 6))
    derivative[..., :3, :3] = np.eye(3)
    derivative[..., 3:, 3:] = np.linalg.solve(axes, rate_axes_zxy(q))
    return np.concatenate([q[..., :3], angles], axis=-1), derivative


def moving_centre(
    q: np.ndarray, direction: np.ndarray, coordinate: int, reach: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Laws act at the point ``direction * f(q[coordinate])`` (m) of the joint frame.

    f is the angle itself or, with a reach, ``reach tanh(angle / reach)``. The point's displacement
    from neutral is d + (R - 1) c; ``direction`` (J, 3) m/rad.
    """
    turn, angle = matrices(q), q[..., coordinate]
    moved = reach * np.tanh(angle / reach) if reach else angle
    slope = 1.0 / np.cosh(angle / reach) ** 2 if reach else np.ones_like(angle)
    centre = direction * moved[..., None]
    shift = q[..., :3] + np.einsum("...ij,...j->...i", turn - np.eye(3), centre)
    derivative = np.zeros((*q.shape, 6))
    derivative[...] = np.eye(6)
    arm = np.einsum("...ij,...j->...i", turn, centre)
    axes = rate_axes_zxy(q)
    derivative[..., :3, 3:] = np.swapaxes(
        np.cross(np.swapaxes(axes, -1, -2), arm[..., None, :]), -1, -2
    )
    along = np.einsum("...ij,...j->...i", turn - np.eye(3), direction)
    derivative[..., :3, coordinate] += slope[..., None] * along
    return np.concatenate([shift, q[..., 3:]], axis=-1), derivative
