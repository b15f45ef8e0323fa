"""Evidence for a group of strengths in a linearised problem, against none of them.

Readings are whitened, base and nuisances projected out: residual r, signatures F in prior SDs of
the strengths. With strengths ~ N(0, t^2) the evidence (log of the ratio of marginal likelihoods) is
1/2 sum [ t^2 b^2 / (1 + t^2 l) - log(1 + t^2 l) ] over the eigenvalues l of F'F, b the components
of F'r; t is averaged over a few sizes. Strengths of one sign have half a normal as prior.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, logsumexp

from spinepipe.effects.contract import Array

SIZES = np.array([0.1, 0.3, 1.0, 3.0])
"""Sizes of strengths, in declared prior SDs, that are held equally likely."""


@dataclass(frozen=True)
class Group:
    """Strengths that share a size: eigenvalues (k,) and vectors (k, k) of their F'F.

    ``signs`` (k,): the side of off that bounds allow, 0 for both.
    """

    eigenvalues: Array
    vectors: Array
    signs: Array

    @classmethod
    def of(cls, gram: Array, signs: Array) -> "Group":
        """The group with F'F (k, k)."""
        values, vectors = np.linalg.eigh(gram)
        return cls(np.maximum(values, 0.0), vectors, signs)

    def log_evidence(self, moments: Array) -> Array:
        """(D,) evidence for F'r of each draw, (k, D)."""
        components = self.vectors.T @ moments
        found = []
        for size in SIZES:
            variance = 1.0 / (size**-2.0 + self.eigenvalues)
            gain = 0.5 * np.sum(variance[:, None] * components**2, axis=0)
            cost = 0.5 * np.sum(np.log1p(size**2 * self.eigenvalues))
            found.append(gain - cost + self._one_sided(variance, components))
        return np.asarray(logsumexp(np.stack(found), axis=0) - np.log(len(SIZES)))

    def _one_sided(self, variance: Array, components: Array) -> Array:
        """(D,) what the signs add: twice the posterior's share on the allowed side, each."""
        there = self.signs != 0.0
        if not there.any():
            return np.zeros(components.shape[1])
        mean = (self.vectors @ (variance[:, None] * components))[there]
        sd = np.sqrt(np.einsum("ij,j,ij->i", self.vectors, variance, self.vectors))[there]
        sides = self.signs[there, None] * mean / sd[:, None]
        return np.asarray(np.sum(np.log(2.0) + log_ndtr(sides), axis=0))

    def estimate(self, moments: Array) -> Array:
        """(k,) strengths, in prior SDs, that explain most, shrunk a little where nothing tells."""
        inverse = 1.0 / (SIZES[-1] ** -2.0 + self.eigenvalues)
        found: Array = self.vectors @ (inverse * (self.vectors.T @ moments))
        return np.where(self.signs * found < 0.0, 0.0, found)
