"""Decompositions that do not give up: singular values, least squares, symmetric eigenvalues.

LAPACK's divide and conquer (`gesdd`, `gelsd`, `syevd`) fails on finite matrices now and then, and
on which ones hangs on the processor: its rounding decides. So it is tried first, being the fastest,
and where it gives up QR iterations (`gesvd`, `syev`) or Krylov steps (`lsmr`) do the work.
Columns of zeros only, on which it was seen to fail, are left out before and put back.

Where divide and conquer succeeds and no column is zero, results are numpy's or scipy's to the last
bit. All of the library decomposes here; `docs/decisions/0012-same-bytes.md` says more.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
from numpy.linalg import LinAlgError
from numpy.typing import ArrayLike, NDArray
from scipy import optimize
from scipy.optimize import OptimizeResult

__all__ = [
    "NotFiniteError",
    "bounded_least_squares",
    "bounded_lstsq",
    "eigh",
    "lstsq",
    "orth",
    "pinvh",
    "svd",
]

Array = NDArray[np.float64]

KRYLOV = {"atol": 1e-15, "btol": 1e-15, "conlim": 0.0}
"""Where `lsmr` stops: where rounding ends its progress."""

KRYLOV_STEPS = 10
"""Steps of `lsmr` per unknown at most; without rounding one would do."""


class NotFiniteError(ValueError):
    """A matrix to decompose holds numbers that are not finite."""


def svd(matrix: ArrayLike) -> tuple[Array, Array, Array]:
    """Thin singular value decomposition of a matrix (M, N), or of each of a stack (..., M, N).

    Returns
    -------
    left (..., M, K), sizes (..., K) falling, right (..., K, N); K = min(M, N). Both sides are
    orthonormal, also where sizes are zero.

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given = _finite(matrix)
    if given.ndim == 2:
        return _svd(given)
    if _not_zero(given).all():
        try:
            return _gesdd(given)
        except LinAlgError:  # one matrix stops all of them
            pass
    *stack, rows, columns = given.shape
    least = min(rows, columns)
    left = np.empty((*stack, rows, least))
    sizes, right = np.empty((*stack, least)), np.empty((*stack, least, columns))
    for place in np.ndindex(*stack):
        left[place], sizes[place], right[place] = _svd(given[place])
    return left, sizes, right


def lstsq(matrix: ArrayLike, targets: ArrayLike) -> tuple[Array, int]:
    """Least squares: the solution of least norm, and the rank of the matrix.

    Parameters
    ----------
    matrix : (M, N). targets : (M,) or (M, k).

    Returns
    -------
    solution (N,) or (N, k), zero where a column is; rank by numpy's measure, singular values above
    the largest times max(M, N) times the rounding error.

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given, wanted = _finite(matrix), _finite(targets)
    rcond = max(given.shape) * np.finfo(float).eps
    there = _not_zero(given)
    solution = np.zeros((given.shape[1], *wanted.shape[1:]))
    some = _only(given, there)
    try:
        solution[there], _, rank, _ = np.linalg.lstsq(some, wanted, rcond=rcond)
        return solution, int(rank)
    except LinAlgError:
        left, sizes, right = _gesvd(some)
        seen = sizes > rcond * sizes.max(initial=0.0)
        solution[there] = (right[seen].T / sizes[seen]) @ (left[:, seen].T @ wanted)
        return solution, int(np.count_nonzero(seen))


def orth(matrix: ArrayLike, rcond: float) -> Array:
    """(M, p) orthonormal basis of the columns of a matrix (M, N), N above zero.

    ``rcond``: directions with less than this share of the largest singular value are none.

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given = _finite(matrix)
    some = _only(given, _not_zero(given))
    if not some.size:
        return np.zeros((len(given), 0))
    try:
        return np.asarray(scipy.linalg.orth(some, rcond=rcond))
    except LinAlgError:
        left, sizes, _ = _gesvd(some)
        return left[:, sizes > rcond * sizes.max(initial=0.0)]


def eigh(matrix: ArrayLike) -> tuple[Array, Array]:
    """Eigenvalues (N,), rising, and eigenvectors (N, N) in columns, of a symmetric matrix (N, N).

    Or of each of a stack (..., N, N).

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given = _finite(matrix)
    try:
        values, vectors = np.linalg.eigh(given)
    except LinAlgError:  # one matrix stops all of them
        values, vectors = np.empty(given.shape[:-1]), np.empty(given.shape)
        for place in np.ndindex(*given.shape[:-2]):
            try:
                values[place], vectors[place] = np.linalg.eigh(given[place])
            except LinAlgError:  # QR iterations
                values[place], vectors[place] = scipy.linalg.eigh(given[place], driver="ev")
    return values, vectors


def pinvh(matrix: ArrayLike, rcond: float) -> Array:
    """(N, N) pseudo-inverse of a symmetric matrix (N, N).

    ``rcond``: eigenvalues of less than this share of the largest, in absolute value, count as zero.

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given = _finite(matrix)
    there = _not_zero(given)
    some = given if there.all() else given[np.ix_(there, there)]
    try:
        inverse = np.linalg.pinv(some, rcond=rcond, hermitian=True)
    except LinAlgError:
        values, vectors = scipy.linalg.eigh(some, driver="ev")
        seen = np.abs(values) > rcond * np.abs(values).max(initial=0.0)
        inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    result = np.zeros_like(given)
    result[np.ix_(there, there)] = inverse
    return result


def bounded_least_squares(
    residual: Callable[[Array], Array],
    start: Array,
    jacobian: Callable[[Array], Array],
    bounds: tuple[Array, Array],
    **settings: Any,
) -> OptimizeResult:
    """Least sum of squares inside bounds, by `scipy.optimize.least_squares` with dogbox steps.

    Its Gauss-Newton steps come from `gelsd`; where that gives up, the fit begins again with `lsmr`.

    Parameters
    ----------
    residual : (m,) to (N,). start : (m,), inside the bounds. jacobian : (m,) to (N, m).
    bounds : (m,) each. settings : further ones of `scipy.optimize.least_squares`.
    """
    whole = {"jac": jacobian, "bounds": bounds, "method": "dogbox", **settings}
    try:
        return optimize.least_squares(residual, start, **whole)
    except LinAlgError:
        options = {**KRYLOV, "maxiter": KRYLOV_STEPS * len(start)}
        return optimize.least_squares(
            residual, start, tr_solver="lsmr", tr_options=options, **whole
        )


def bounded_lstsq(matrix: ArrayLike, targets: ArrayLike, bounds: tuple[Array, Array]) -> Array:
    """(N,) least squares of a matrix (M, N) of full rank inside bounds (N,), exact on bounds.

    Where `gelsd` gives up, `lsmr` and an interior method do it: near bounds, not on them.

    Raises
    ------
    NotFiniteError : where an entry is not finite.
    """
    given, wanted = _finite(matrix), _finite(targets)
    try:
        found = optimize.lsq_linear(given, wanted, bounds, "bvls")
    except LinAlgError:
        found = optimize.lsq_linear(
            given,
            wanted,
            bounds,
            "trf",
            tol=1e-14,
            lsq_solver="lsmr",
            lsmr_tol=KRYLOV["atol"],
            lsmr_maxiter=KRYLOV_STEPS * given.shape[1],
        )
    return np.asarray(found.x)


def _finite(matrix: ArrayLike) -> Array:
    given = np.asarray(matrix, dtype=np.float64)
    bad = ~np.isfinite(given)
    if bad.any():
        shape = " x ".join(map(str, given.shape))
        first = tuple(int(place) for place in np.argwhere(bad)[0])
        raise NotFiniteError(
            f"{np.count_nonzero(bad)} of {shape} numbers are not finite, the first at {first}: "
            "nothing can be decomposed"
        )
    return given


def _not_zero(matrix: Array) -> NDArray[np.bool_]:
    """(..., N) whether a column of (..., M, N) holds anything but zeros."""
    return np.asarray(matrix.any(axis=-2))


def _only(matrix: Array, there: NDArray[np.bool_]) -> Array:
    """Columns that are there; the matrix itself where all are."""
    return matrix if there.all() else matrix[:, there]


def _gesdd(matrix: Array) -> tuple[Array, Array, Array]:
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    return left, sizes, right


def _gesvd(matrix: Array) -> tuple[Array, Array, Array]:
    """By QR iterations; a `LinAlgError` where these end nowhere too, of which none is known."""
    left, sizes, right = scipy.linalg.svd(matrix, full_matrices=False, lapack_driver="gesvd")
    return left, sizes, right


def _svd(matrix: Array) -> tuple[Array, Array, Array]:
    there = _not_zero(matrix)
    some = _only(matrix, there)
    try:
        left, sizes, right = _gesdd(some)
    except LinAlgError:
        left, sizes, right = _gesvd(some)
    if there.all():
        return left, sizes, right
    # the decomposition of the whole matrix from that of the columns that are there
    known, least = len(sizes), min(len(left), len(there))
    added = least - known  # directions of size zero, each seen by one of the columns left out
    whole = np.zeros((least, len(there)))
    whole[:known, there] = right
    whole[range(known, least), np.flatnonzero(~there)[:added]] = 1.0
    if added:  # QR of what is known beside zeros: further columns of Q are orthonormal to it
        more = np.linalg.qr(np.pad(left, ((0, 0), (0, added)))).Q[:, known:]
        left = np.concatenate([left, more], axis=1)
    return left, np.pad(sizes, (0, added)), whole
