"""Which of many equilibria are stable for sure, by tests that are sufficient and cheap.

In coordinates where damping is one, M x'' + x' + (S + A) x = 0, with the tangent's symmetric and
skew parts S and A. Both tests stand on an energy whose decay proves stability:

V = x'.Mx' / 2 + e x'.Mx + x.(S + e) x / 2,  dV/dt = -x'.(1 - e M) x' - x'.A x - e x.S x,

so that motion decays if S - A^T (1 - e M)^-1 A / (4 e) is positive definite for any e < 1 / |M|.
With e = 1 / (2 |M|) it is enough that S - |A|^2 |M| is, which needs no mass matrix: |M| is at most
its trace. Those that fail this are tried with the whole mass matrix.
"""

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics.many.motion import ManyMotion
from spinepipe.statics.many.spines import Spines

Flags = NDArray[np.bool_]

SHARE = 0.75
"""e times the norm of M. Of L1-L4 and T12-S1 under moments, 0.6 to 0.9 prove about as many."""


def surely_stable(spines: Spines, motion: ManyMotion, tangents: Array) -> Flags:
    """(M,) False where nothing is proven; tangents (M, n, n)."""
    damping = spines.damping.reshape(len(tangents), -1)
    scale = 1.0 / np.sqrt(damping)
    scaled = tangents * scale[:, :, None] * scale[:, None, :]
    symmetric = 0.5 * (scaled + scaled.transpose(0, 2, 1))
    skew = scaled - symmetric
    twist = 0.5 * np.einsum("mij,mij->m", skew, skew)
    shift = twist * (_inertia(spines, motion).reshape(damping.shape) / damping).sum(axis=1)
    found = _positive(symmetric - shift[:, None, None] * np.eye(damping.shape[1]))
    doubt = np.flatnonzero(~found)
    if len(doubt):
        mass = _mass(spines.part(doubt), motion.part(doubt))
        mass *= scale[doubt, :, None] * scale[doubt, None, :]
        found[doubt] = _energy_decays(mass, symmetric[doubt], skew[doubt])
    return found


def _energy_decays(mass: Array, symmetric: Array, skew: Array) -> Flags:
    """The test with the whole mass matrix; the Frobenius norm is no less than |M|."""
    share = SHARE / np.linalg.norm(mass, axis=(1, 2))[:, None, None]
    room = np.eye(mass.shape[1]) - share * mass
    twist = skew.transpose(0, 2, 1) @ np.linalg.solve(room, skew) / (4.0 * share)
    return _positive(symmetric - twist)


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
    centres = motion.points(spines.coms)
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


def _mass(spines: Spines, motion: ManyMotion) -> Array:
    """(M, n, n) mass matrices, kg, kg m and kg m2."""
    centres = motion.points(spines.coms)
    count, joints = spines.masses.shape
    found = np.zeros((count, 6 * joints, 6 * joints))
    for body in range(joints):
        velocities = motion.velocities(body, centres[:, body])
        found += spines.masses[:, body, None, None] * velocities @ velocities.transpose(0, 2, 1)
        turned, axes = motion.rotations[:, body], motion.axes(body)
        inertia = turned @ spines.inertias[:, body] @ turned.transpose(0, 2, 1)
        found += axes @ inertia @ axes.transpose(0, 2, 1)
    return found
