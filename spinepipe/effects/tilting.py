"""Coordinates of a joint's motion in tilted axes, exact, with derivatives.

A motion of rotation R and translation t has, in axes tilted by T, the rotation ``T' R T`` and the
translation ``T' t``. Angular velocities turn with the axes, so with E the matrix of rotation axes

    E(seen) d(seen) = T' E(q) dq   and   E(seen) d(seen) = T' (R - 1) E(tilt) d(tilt);

further derivatives follow from these two by the product rule.
"""

import numpy as np

from spinepipe.effects.contract import Array, Parameter, Placement, PlacementByParameter
from spinepipe.effects.turning import angles_by_angles, solve_axes, turning
from spinepipe.frames import zxy_angles

LARGEST_TILT_RAD = 0.5


def tilt_parameters(typical: float) -> tuple[Parameter, ...]:
    """Three tilts in rad about the joint frame's z, x' and y'', off at 0, with a typical size."""
    about = {"extension": "right", "right_bending": "anterior", "left_rotation": "superior"}
    return tuple(
        Parameter(
            name=f"tilt_{name}",
            unit="rad",
            low=-LARGEST_TILT_RAD,
            high=LARGEST_TILT_RAD,
            default=typical,
            prior_scale=typical,
            logarithmic=False,
            meaning=f"tilt of the axes about the joint's {axis} axis",
            off=0.0,
        )
        for name, axis in about.items()
    )


def tilted(q: Array, tilts: Array) -> Placement:
    """Coordinates (J, 6) in axes tilted by Z-X'-Y'' angles (J, 3) rad."""
    true, back = turning(q[:, 3:]), turning(tilts).rotation.swapaxes(-1, -2)
    angles = zxy_angles(back @ true.rotation @ back.swapaxes(-1, -2))
    seen = turning(angles)
    moved = np.einsum("jxy,jyab->jxab", back, true.axes_by_angle)
    by_angle, by_angles = angles_by_angles(seen, back @ true.axes, moved)
    first, second = np.zeros((len(q), 6, 6)), np.zeros((len(q), 6, 6, 6))
    first[:, :3, :3], first[:, 3:, 3:] = back, by_angle
    second[:, 3:, 3:, 3:] = by_angles
    translation = np.einsum("jxy,jy->jx", back, q[:, :3])
    return Placement(np.hstack([translation, angles]), first, second)


def tilted_by_tilt(q: Array, tilts: Array) -> PlacementByParameter:
    """Derivatives of `tilted` by the three tilts at fixed q."""
    true, tilt = turning(q[:, 3:]), turning(tilts)
    back = tilt.rotation.swapaxes(-1, -2)
    seen = turning(zxy_angles(back @ true.rotation @ tilt.rotation))
    by_angle = solve_axes(seen.axes, back @ true.axes)
    by_tilt = solve_axes(seen.axes, back @ (true.rotation - np.eye(3)) @ tilt.axes)
    back_by_tilt = tilt.first.swapaxes(-1, -2)
    moved = np.einsum("jpxy,jya->jxap", back_by_tilt, true.axes)
    moved -= np.einsum("jxkl,jlp,jka->jxap", seen.axes_by_angle, by_tilt, by_angle)
    by_q, first = np.zeros((len(q), 6, 3)), np.zeros((len(q), 6, 6, 3))
    by_q[:, :3] = np.einsum("jpxy,jy->jxp", back_by_tilt, q[:, :3])
    by_q[:, 3:] = by_tilt
    first[:, :3, :3] = back_by_tilt.transpose(0, 2, 3, 1)
    first[:, 3:, 3:] = solve_axes(seen.axes, moved)
    return PlacementByParameter(by_q, first)
