"""Is an equilibrium stable? Decided by the linearised damped motion M x'' + C x' + K x = 0.

K is not symmetric under a constant moment, so its symmetric part alone decides nothing. Cheap
sufficient tests come first; the 2n eigenvalues are computed only when these leave a doubt.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals
from scipy.linalg.lapack import dpotrf, dpotri

from spinepipe.effects.contract import Array
from spinepipe.world import Chain

ROUNDING = 1e-9
"""Growth slower than this share of the stiffness (damping is one) is rounding error."""


@dataclass(frozen=True)
class Stability:
    """Verdict and, as a warning, whether the tangent's symmetric part is positive definite."""

    stable: bool
    symmetric_part_positive: bool


def stability(chain: Chain, q: Array, tangent: Array, sign: int) -> Stability:
    """Stability of the equilibrium at q (n,) with tangent K (n, n), its determinant's sign.

    An odd number of growing modes shows as a negative determinant. With K = S + A (symmetric and
    skew parts) and in coordinates where the damping is the identity, the motion decays for sure
    when S is positive and |A|^2 |M| < min eig S: each mode x of the pencil
    then obeys m l^2 + l + (s + i a) = 0 with a^2 m < s, whose roots have negative real parts.
    """
    damping = chain.model.damping.ravel()
    scale = 1.0 / np.sqrt(damping)
    scaled = tangent * scale[:, None] * scale
    skew = 0.5 * (scaled - scaled.T)
    symmetric = scaled - skew
    smallest = _smallest_eigenvalue_bound(symmetric)
    positive = smallest > 0.0
    if sign < 0:
        return Stability(stable=False, symmetric_part_positive=positive)
    if np.array_equal(tangent, tangent.T):  # then inertia and damping decide nothing
        return Stability(stable=positive, symmetric_part_positive=positive)
    twist = 0.5 * float(np.sum(skew * skew))  # |A|^2: a skew matrix's singular values are pairs
    mass = chain.mass_matrix(q) * scale[:, None] * scale
    if positive and twist * np.linalg.norm(mass) < smallest:
        return Stability(stable=True, symmetric_part_positive=True)
    return Stability(_decays(mass, scaled), positive)


def _smallest_eigenvalue_bound(symmetric: Array) -> float:
    """A lower bound > 0 of the smallest eigenvalue when positive definite, else 0."""
    lower, info = dpotrf(symmetric, lower=True)
    if info != 0:
        return 0.0
    inverse, _ = dpotri(lower, lower=True)
    inverse = inverse + inverse.T  # dpotri fills the lower half, dpotrf cleared the upper one
    inverse[np.diag_indices_from(inverse)] *= 0.5
    by_square = float(np.linalg.norm(inverse))
    by_row = float(np.abs(inverse).sum(axis=0).max())
    return 1.0 / min(by_square, by_row)


def _decays(mass: Array, stiffness: Array) -> bool:
    """Whether all modes of M x'' + x' + K x = 0 decay; massless chains follow x' + K x = 0.

    A growing mode l (m l + 1) = -k has |m l + 1| > 1, hence |l| < |K|: rates beyond are those of
    directions without inertia, infinite but for rounding, which may give them either sign.
    """
    n = len(stiffness)
    if not mass.any():
        return float(eigvals(stiffness).real.min()) > 0.0
    identity, nothing = np.eye(n), np.zeros((n, n))
    a = np.block([[nothing, identity], [-stiffness, -identity]])
    b = np.block([[identity, nothing], [nothing, mass]])
    rates, size = eigvals(a, b), float(np.linalg.norm(stiffness))
    slow = rates[np.abs(rates) < size]
    return float(slow.real.max(initial=-np.inf)) < ROUNDING * size
