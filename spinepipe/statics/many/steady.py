"""Which of many equilibria are stable for sure, by a test that is sufficient and cheap.

With the tangent's symmetric and skew parts S and A in coordinates where damping is one, motion
decays if min eig S > |A|^2 |M| (`spinepipe.statics.stability`). |M| is at most the trace of M, so
it is enough that S - |A|^2 tr(M) is positive definite: one Cholesky factor.
"""

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics.many.motion import ManyMotion
from spinepipe.statics.many.spines import Spines

Flags = NDArray[np.bool_]


def surely_stable(spines: Spines, motion: ManyMotion, tangents: Array) -> Flags:
    """(M,) False where nothing is proven; tangents (M, n, n)."""
    damping = spines.damping.reshape(len(tangents), -1)
    scale = 1.0 / np.sqrt(damping)
    scaled = tangents * scale[:, :, None] * scale[:, None, :]
    symmetric = 0.5 * (scaled + scaled.transpose(0, 2, 1))
    skew = scaled - symmetric
    twist = 0.5 * np.einsum("mij,mij->m", skew, skew)
    shift = twist * (_inertia(spines, motion).reshape(damping.shape) / damping).sum(axis=1)
    at = np.arange(damping.shape[1])
    symmetric[:, at, at] -= shift[:, None]
    return _positive(symmetric)


def _positive(symmetric: Array) -> Flags:
    """Which matrices are positive definite."""
    found = np.ones(len(symmetric), dtype=bool)
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        found = np.linalg.eigvalsh(symmetric)[:, 0] > 0.0
    return found


def _inertia(spines: Spines, motion: ManyMotion) -> Array:
    """(M, J, 6) no less than the diagonal of the mass matrix."""
    centres = (motion.rotations @ spines.coms[..., None])[..., 0] + motion.translations
    largest = np.trace(spines.inertias, axis1=2, axis2=3)
    count, joints = spines.masses.shape
    found = np.zeros((count, joints, 6))
    for body in range(joints):
        arms = centres[:, None, body] - motion.pivots[:, : body + 1]
        mass = spines.masses[:, body, None]
        found[:, : body + 1, :3] += mass[..., None]
        turned = mass * np.sum(arms**2, axis=2) + largest[:, None, body]
        found[:, : body + 1, 3:] += turned[..., None]
    return found
