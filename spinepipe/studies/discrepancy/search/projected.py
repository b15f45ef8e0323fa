"""The linearised problem of a cohort: signatures with base, nuisances and named effects taken out.

What specimens have of their own is projected out of each specimen; what they share (strengths and
shapes of named effects) couples them and is taken out of the sums.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.joint_fit import JointFit
from spinepipe.effects.contract import Array

SEEN = 1e-8
"""Directions of a Jacobian with less than this share of its largest singular value are none."""

UNSEEN = 1e-6
"""A signature with less of its square left than this is nothing but what was taken out."""


@dataclass(frozen=True)
class Taken:
    """What is taken out of a specimen's whitened readings.

    Attributes
    ----------
    own : (N, p) orthonormal, the specimen's own unknowns.
    shared : (N, a) the shared unknowns' columns, without what ``own`` holds of them.
    residual : (N,) measured less predicted, without what ``own`` holds of it.
    """

    own: Array
    shared: Array
    residual: Array

    def out_of(self, columns: Array) -> Array:
        """(N, m) columns without the specimen's own directions."""
        result: Array = columns - self.own @ (self.own.T @ columns)
        return result


def taken_out(fit: JointFit) -> dict[str, Taken]:
    """What a fit takes out of each specimen."""
    owners: dict[int, set[str]] = {}
    for name, member in fit.hypothesis.members.items():
        for number in member.numbers:
            owners.setdefault(number, set()).add(name)
    common = sorted(number for number, names in owners.items() if len(names) > 1)
    return {
        name: _taken(fit, name, np.array(member.numbers), common)
        for name, member in fit.hypothesis.members.items()
    }


def _taken(fit: JointFit, name: str, numbers: Array, common: Sequence[int]) -> Taken:
    jacobian = fit.jacobians[name]
    is_common = np.isin(numbers, common)
    own = _basis(jacobian[:, ~is_common])
    shared = np.zeros((len(jacobian), len(common)))
    places = [common.index(number) for number in numbers[is_common]]
    np.add.at(shared.T, places, jacobian[:, is_common].T)
    shared -= own @ (own.T @ shared)
    residual = -fit.residuals[name]  # measured less predicted: what a signature is to make
    return Taken(own, shared, residual - own @ (own.T @ residual))


def _basis(columns: Array) -> Array:
    """(N, p) orthonormal basis of columns."""
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    left, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
    seen: Array = left[:, sizes > SEEN * max(sizes.max(initial=0.0), SEEN)]
    return seen


@dataclass(frozen=True)
class Products:
    """Products of a specimen's signatures; M columns, the data and D draws of the null.

    Attributes
    ----------
    gram : (M, M) F'F. moments : (M, 1 + D) F'r of the data and of the draws.
    raw : (M,) squared norms in noise SDs before anything was taken out.
    shared : (M, a) F'A of the shared unknowns. gram_shared : (a, a) A'A.
    moments_shared : (a, 1 + D) A'r.
    """

    gram: Array
    moments: Array
    raw: Array
    shared: Array
    gram_shared: Array
    moments_shared: Array


def drawn(taken: Taken, draws: int, rng: np.random.Generator) -> Array:
    """(N, 1 + D) the data's residual, and residuals as the null would have them."""
    return np.column_stack([taken.residual, rng.standard_normal((len(taken.residual), draws))])


def products(taken: Taken, white: Array, raw: Array, errors: Array) -> Products:
    """Products of whitened signatures (N, M) with themselves, the errors and what is shared."""
    left = taken.out_of(white)
    gram, moments = left.T @ left, left.T @ errors
    gone = np.diagonal(gram) < UNSEEN * raw
    gram[gone], gram[:, gone], moments[gone] = 0.0, 0.0, 0.0
    shared = np.where(gone[:, None], 0.0, left.T @ taken.shared)
    own = taken.shared.T
    return Products(gram, moments, raw, shared, own @ taken.shared, own @ errors)


@dataclass(frozen=True)
class Linearised:
    """Products of all specimens; what they share, summed."""

    of: Mapping[str, Products]
    gram_shared: Array
    moments_shared: Array

    def without_shared(self, gram: Array, moments: Array, coupled: Array) -> tuple[Array, Array]:
        """Products (k, k), (k, 1 + D) of k strengths less what shared unknowns take of them.

        ``coupled`` (k, a): products of the strengths with the shared unknowns.
        """
        if not coupled.shape[1]:
            return gram, moments
        gain = coupled @ np.linalg.pinv(self.gram_shared, rcond=1e-10, hermitian=True)
        return gram - gain @ coupled.T, moments - gain @ self.moments_shared


def linearised(of: Mapping[str, Products]) -> Linearised:
    """The problem of a cohort from those of its specimens."""
    parts = list(of.values())
    gram = np.sum([part.gram_shared for part in parts], axis=0)
    return Linearised(of, gram, np.sum([part.moments_shared for part in parts], axis=0))
