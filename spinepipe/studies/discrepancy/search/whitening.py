"""Whitening: readings of a specimen as numbers of SD one, independent, nuisances taken out.

The covariance of the readings is that of the noise plus ``U U'``, the nuisances' share. With V the
noise covariance and V^-1/2 U = P S Q', the inverse root of the whole is
(I + P ((1 + S^2)^-1/2 - I) P') V^-1/2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.readings import Repeats


@dataclass(frozen=True)
class Whitening:
    """Makes residuals of one specimen, or their derivatives, independent with SD one.

    Attributes
    ----------
    used : per test (T, J, 6), which readings there are.
    roots : per test (J, 6, T, T), inverse root of the noise covariance on the steps that are used.
    directions : (N, k) orthonormal directions in which nuisances move the readings.
    shrink : (k,) factor less one by which these are shortened.
    mixing : (k, K) orthonormal rows, what each of K nuisances has of each direction.
    """

    used: tuple[NDArray[np.bool_], ...]
    roots: tuple[Array, ...]
    directions: Array
    shrink: Array
    mixing: Array

    @property
    def count(self) -> int:
        """N, number of readings."""
        return sum(int(used.sum()) for used in self.used)

    def noise_only(self, rows: Sequence[Array]) -> Array:
        """(N,) or (N, m) of rows (T, J, 6) or (T, J, 6, m) per test: noise has SD one."""
        found = []
        for root, used, array in zip(self.roots, self.used, rows, strict=True):
            flat = array.reshape(*array.shape[:3], -1)
            there = np.where(used[..., None], flat, 0.0).transpose(1, 2, 0, 3)
            white = (root @ there).transpose(2, 0, 1, 3)[used]  # over the load steps of a test
            found.append(white[:, 0] if array.ndim == 3 else white)
        return np.concatenate(found)

    def __call__(self, rows: Sequence[Array]) -> Array:
        """(N,) or (N, m): noise and nuisances together have SD one."""
        return self.shortened(self.noise_only(rows))

    def shortened(self, white: Array) -> Array:
        """Noise-whitened rows (N, ...) with the nuisances' share taken out."""
        inside = self.directions.T @ white
        shrink = self.shrink if white.ndim == 1 else self.shrink[:, None]
        result: Array = white + self.directions @ (shrink * inside)
        return result

    @property
    def sizes(self) -> Array:
        """(k,) how far one prior SD of the nuisances moves each direction, in noise SD."""
        return np.sqrt(np.maximum((1.0 + self.shrink) ** -2.0 - 1.0, 0.0))

    def left_over(self, white: Array) -> Array:
        """(N,) of noise-whitened residuals (N,) with nuisances at their most likely values.

        These leave (I + U U')^-1 of a residual: the square of what shortens it.
        """
        result: Array = self.shortened(self.shortened(white))
        return result

    @property
    def freedom(self) -> Array:
        """(N,) degrees of freedom that each reading keeps beside the nuisances."""
        taken = 1.0 - (1.0 + self.shrink) ** 2
        result: Array = 1.0 - self.directions**2 @ taken
        return result

    @property
    def moves(self) -> Array:
        """(N, K) how far one prior SD of each nuisance moves each reading, in noise SD."""
        result: Array = (self.directions * self.sizes) @ self.mixing
        return result

    def lengthened(self, white: Array) -> Array:
        """What `shortened` made, back to noise-whitened rows (N, ...)."""
        inside = self.directions.T @ white
        longer = 1.0 / (1.0 + self.shrink) - 1.0
        longer = longer if white.ndim == 1 else longer[:, None]
        result: Array = white + self.directions @ (longer * inside)
        return result


def whitening(tests: Sequence[Repeats], noise: Noise) -> Whitening:
    """Whitening for the mean over the cycles, without nuisances."""
    used = tuple(test.count > 0 for test in tests)
    roots = tuple(_roots(test, noise) for test in tests)
    count = sum(int(one.sum()) for one in used)
    return Whitening(used, roots, np.zeros((count, 0)), np.zeros(0), np.zeros((0, 0)))


def with_nuisances(plain: Whitening, moved: Sequence[Array]) -> Whitening:
    """The whitening with nuisances; ``moved`` (T, J, 6, k) per test by one prior SD of each."""
    return _with_moves(plain, *svd(plain.noise_only(moved)))


def joined(first: Whitening, second: Whitening, moves: Array) -> Whitening:
    """Whitening of the readings of both, one behind the other; ``moves`` (N, K) in noise SD."""
    plain = Whitening(
        (*first.used, *second.used),
        (*first.roots, *second.roots),
        np.zeros((first.count + second.count, 0)),
        np.zeros(0),
        np.zeros((0, 0)),
    )
    return _with_moves(plain, *svd(moves))


def _with_moves(plain: Whitening, directions: Array, sizes: Array, mixing: Array) -> Whitening:
    """The whitening with nuisances that move readings by ``directions * sizes @ mixing``."""
    seen = sizes > 1e-3  # of a noise SD: less is as good as none
    shrink = 1.0 / np.sqrt(1.0 + sizes[seen] ** 2) - 1.0
    return Whitening(plain.used, plain.roots, directions[:, seen], shrink, mixing[seen])


def _roots(test: Repeats, noise: Noise) -> Array:
    steps, joints = test.count.shape[:2]
    serial, drift = noise.correlations(steps), noise.drift(steps)
    roots = np.zeros((joints, 6, steps, steps))
    known: dict[tuple[int, bytes], Array] = {}
    for joint in range(joints):
        for coordinate in range(6):
            count = test.count[:, joint, coordinate]
            key = (coordinate, count.tobytes())
            if key not in known and count.any():
                sd, shared = noise.sd[coordinate], noise.accuracy[coordinate]
                known[key] = _inverse_root(sd**2 * serial, shared**2 * drift, count)
            if count.any():
                roots[joint, coordinate] = known[key]
    return roots


def _inverse_root(own: Array, shared: Array, count: NDArray[np.int64]) -> Array:
    """(T, T) inverse root of the covariance of means over ``count`` (T,) cycles; 0 where none.

    ``own``, ``shared`` (T, T): covariance of what each cycle has by itself, and of what all have.
    """
    used = np.flatnonzero(count)
    root = np.zeros_like(own)
    shrunk = 1.0 / np.sqrt(count[used])
    here = np.ix_(used, used)
    factor = np.linalg.cholesky(own[here] * np.outer(shrunk, shrunk) + shared[here])
    root[here] = np.linalg.inv(factor)
    return root
