"""Decompositions against what defines them, and against gesdd where that gives up.

Tolerances: rounding of a backward stable decomposition is a few times the size of the matrix times
1.1e-16 of its largest singular value; `LEAST` is some hundred times that of the largest one here.

Catches a decomposition that fails or is wrong on matrices where LAPACK gives up.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import scipy.linalg
import spring_chain_cases as chains
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from scipy.optimize import least_squares
from sweeps import sweep

from spinepipe.decomposition import (
    NotFiniteError,
    bounded_least_squares,
    bounded_lstsq,
    eigh,
    lstsq,
    orth,
    pinvh,
    svd,
)
from spinepipe.studies.discrepancy.search import baseline, whitening
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.whitening import Whitening
from spinepipe.studies.discrepancy.store import at_once

pytestmark = pytest.mark.numeric

Array = NDArray[np.float64]

LEAST = 1e-11

ZERO_SHARE = 1e-8
"""Singular values below this share of the largest count as zero; made up ones are above 1e-2."""


@contextmanager
def divide_and_conquer_gives_up() -> Iterator[list[str]]:
    """LAPACK as on the processor where it failed: every driver that divides raises.

    Yields the names of those that were asked.
    """
    asked: list[str] = []

    def refuses(name: str) -> Callable[..., object]:
        def refuse(*_: object, **__: object) -> object:
            asked.append(name)
            raise LinAlgError(f"{name} did not converge")

        return refuse

    with pytest.MonkeyPatch.context() as patch:
        for name in ("svd", "lstsq", "eigh", "pinv"):
            patch.setattr(np.linalg, name, refuses(name))
        patch.setattr(scipy.linalg, "orth", refuses("orth"))
        for inside in ("dogbox", "bvls"):
            patch.setattr(f"scipy.optimize._lsq.{inside}.lstsq", refuses(inside))
        yield asked


@contextmanager
def as_it_is() -> Iterator[list[str]]:
    yield []


either_way = sweep("lapack", [as_it_is, divide_and_conquer_gives_up])


def made(rows: int, columns: int, rank: int, zeros: int, seed: int) -> Array:
    """(rows, columns) of that rank, or as near as goes, with that many zero columns."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, columns))
    matrix[:, rng.permutation(columns)[:zeros]] = 0.0
    return matrix


SHAPES = [
    *[(30, 12, 12, 0), (30, 12, 5, 0), (30, 12, 7, 4), (30, 12, 12, 12), (30, 12, 0, 0)],
    *[(12, 30, 12, 0), (12, 30, 12, 6), (12, 30, 5, 25), (12, 12, 12, 0), (12, 12, 9, 3)],
    *[(378, 109, 60, 18), (1, 1, 1, 0), (1, 1, 0, 1), (1, 6, 1, 2), (6, 1, 1, 0)],
]
"""Tall, wide and square; rows, columns, rank, zero columns."""

of_each_shape = sweep("matrix", [made(*shape, seed) for seed, shape in enumerate(SHAPES)])


def assert_decomposed(matrix: Array) -> None:
    left, sizes, right = svd(matrix)
    least = min(matrix.shape)
    assert (left.shape, sizes.shape) == ((len(matrix), least), (least,))
    assert right.shape == (least, matrix.shape[1])
    near = LEAST * max(1.0, sizes.max(initial=0.0))
    np.testing.assert_allclose(left * sizes @ right, matrix, rtol=0, atol=near)
    np.testing.assert_allclose(left.T @ left, np.eye(least), rtol=0, atol=LEAST)
    np.testing.assert_allclose(right @ right.T, np.eye(least), rtol=0, atol=LEAST)
    assert np.all(np.diff(sizes) <= 0.0)
    assert np.all(sizes >= 0.0)


# Singular values -------------------------------------------------------------------------------


@either_way
@of_each_shape
def test_singular_vectors_are_orthonormal_and_make_the_matrix(
    matrix: Array, lapack: Callable[[], Iterator[list[str]]]
) -> None:
    with lapack():  # type: ignore[attr-defined]
        assert_decomposed(matrix)


@settings(max_examples=100)
@given(
    rows=st.integers(1, 40),
    columns=st.integers(1, 40),
    rank=st.integers(0, 40),
    zeros=st.integers(0, 40),
    power=st.integers(-120, 120),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_shape_rank_and_size(
    rows: int, columns: int, rank: int, zeros: int, power: int, seed: int
) -> None:
    matrix = made(rows, columns, rank, zeros, seed)
    assert_decomposed(matrix)
    with divide_and_conquer_gives_up():
        assert_decomposed(matrix)
    left, sizes, right = svd(matrix * 2.0**power)
    whole = left * sizes @ right * 2.0**-power
    np.testing.assert_allclose(whole, matrix, rtol=0, atol=LEAST * (1 + np.abs(matrix).max()))


@sweep("shape", [(30, 12), (12, 30), (12, 12), (378, 109), (5, 12, 12)])
def test_without_zero_columns_results_are_numpys_to_the_last_bit(shape: tuple[int, ...]) -> None:
    matrix = np.random.default_rng(1).normal(size=shape)
    for found, expected in zip(
        svd(matrix), np.linalg.svd(matrix, full_matrices=False), strict=True
    ):
        np.testing.assert_array_equal(found, expected)
    flat = matrix.reshape(-1, shape[-1])
    targets = np.random.default_rng(2).normal(size=len(flat))
    solution, _, rank, _ = np.linalg.lstsq(flat, targets)
    np.testing.assert_array_equal(lstsq(flat, targets)[0], solution)
    assert lstsq(flat, targets)[1] == rank
    gram = flat.T @ flat
    for found, expected in zip(eigh(gram), np.linalg.eigh(gram), strict=True):
        np.testing.assert_array_equal(found, expected)
    inverse = np.linalg.pinv(gram, rcond=1e-10, hermitian=True)
    np.testing.assert_array_equal(pinvh(gram, 1e-10), inverse)
    np.testing.assert_array_equal(orth(flat, 1e-8), scipy.linalg.orth(flat, rcond=1e-8))


def test_a_stack_is_its_matrices_one_by_one() -> None:
    """Also where one of them has a zero column, or is one that gesdd gives up on."""
    plain = np.stack([made(12, 12, 12, 0, seed) for seed in range(6)])
    mixed = plain.copy()
    mixed[2, :, 3] = 0.0
    for stack in (plain, mixed, mixed.reshape(2, 3, 12, 12)):
        alone = [svd(matrix) for matrix in stack.reshape(-1, 12, 12)]
        for found, parts in zip(svd(stack), zip(*alone, strict=True), strict=True):
            np.testing.assert_array_equal(found.reshape(np.shape(parts)), parts)


def test_one_matrix_that_fails_leaves_the_rest_of_its_stack_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stack = np.stack([made(12, 12, 12, 0, seed) for seed in range(6)])
    expected, real = np.linalg.svd(stack), np.linalg.svd

    def fails_on_one(matrix: Array, full_matrices: bool) -> object:
        if any(np.array_equal(one, stack[4]) for one in matrix.reshape(-1, 12, 12)):
            raise LinAlgError("SVD did not converge")
        return real(matrix, full_matrices=full_matrices)

    monkeypatch.setattr(np.linalg, "svd", fails_on_one)
    for found, others in zip(svd(stack), expected, strict=True):
        np.testing.assert_array_equal(np.delete(found, 4, axis=0), np.delete(others, 4, axis=0))
    assert_decomposed(stack[4])


def test_zero_columns_are_not_shown_to_lapack(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, real = [], np.linalg.svd

    def spy(matrix: Array, full_matrices: bool) -> object:
        seen.append(matrix.shape)
        return real(matrix, full_matrices=full_matrices)

    monkeypatch.setattr(np.linalg, "svd", spy)
    svd(made(378, 109, 60, 18, 0))
    assert seen == [(378, 91)]


def test_where_qr_gives_up_too_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> object:
        raise LinAlgError("SVD did not converge")

    monkeypatch.setattr(scipy.linalg, "svd", refuse)
    with divide_and_conquer_gives_up(), pytest.raises(LinAlgError, match="did not converge"):
        svd(np.eye(3))


# Least squares, bases, symmetric matrices --------------------------------------------------------


@either_way
@of_each_shape
@sweep("width", [(), (3,)])
def test_least_squares_is_the_normal_equations_at_least_norm(
    matrix: Array, lapack: Callable[[], Iterator[list[str]]], width: tuple[int, ...]
) -> None:
    targets = np.random.default_rng(3).normal(size=(len(matrix), *width))
    _, sizes, right = scipy.linalg.svd(matrix, lapack_driver="gesvd")
    seen = right[: np.count_nonzero(sizes > ZERO_SHARE * sizes.max(initial=1e-300))]
    with lapack():  # type: ignore[attr-defined]
        solution, rank = lstsq(matrix, targets)
    assert rank == len(seen)
    assert solution.shape == (matrix.shape[1], *width)
    slope = matrix.T @ (targets - matrix @ solution)
    np.testing.assert_allclose(slope, 0.0, rtol=0, atol=LEAST * (1.0 + sizes.max()) ** 2)
    np.testing.assert_allclose(seen.T @ (seen @ solution), solution, rtol=0, atol=LEAST)


@either_way
@of_each_shape
def test_a_basis_spans_the_columns_and_nothing_else(
    matrix: Array, lapack: Callable[[], Iterator[list[str]]]
) -> None:
    with lapack():  # type: ignore[attr-defined]
        basis = orth(matrix, ZERO_SHARE)
    assert basis.shape == (len(matrix), np.linalg.matrix_rank(matrix))
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), rtol=0, atol=LEAST)
    near = LEAST * (1.0 + np.abs(matrix).max())
    np.testing.assert_allclose(basis @ (basis.T @ matrix), matrix, rtol=0, atol=near)


@either_way
@of_each_shape
def test_a_pseudo_inverse_meets_the_conditions_of_penrose(
    matrix: Array, lapack: Callable[[], Iterator[list[str]]]
) -> None:
    gram = matrix.T @ matrix / (1.0 + np.abs(matrix).max() ** 2)
    with lapack():  # type: ignore[attr-defined]
        inverse = pinvh(gram, 1e-10)
    near = 1e-8 * (1.0 + np.abs(inverse).max())  # the square of a condition number below 1e3
    np.testing.assert_allclose(gram @ inverse @ gram, gram, rtol=0, atol=near)
    np.testing.assert_allclose(inverse @ gram @ inverse, inverse, rtol=0, atol=near)
    for product in (gram @ inverse, inverse @ gram):
        np.testing.assert_allclose(product, product.T, rtol=0, atol=near)


@either_way
@sweep("size", [1, 3, 60])
def test_eigenvectors_are_orthonormal_and_make_the_matrix(
    size: int, lapack: Callable[[], Iterator[list[str]]]
) -> None:
    matrix = made(size, size, size // 2 + 1, 0, 5)
    matrix = matrix + matrix.T
    with lapack():  # type: ignore[attr-defined]
        values, vectors = eigh(matrix)
    np.testing.assert_allclose(vectors * values @ vectors.T, matrix, rtol=0, atol=1e-10)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(size), rtol=0, atol=LEAST)
    assert np.all(np.diff(values) >= 0.0)


@either_way
def test_eigenvalues_of_a_stack_are_those_of_each(
    lapack: Callable[[], Iterator[list[str]]],
) -> None:
    half = np.random.default_rng(4).normal(size=(3, 2, 5, 5))
    stack = half + half.swapaxes(2, 3)
    with lapack():  # type: ignore[attr-defined]
        values, vectors = eigh(stack)
    made_again = (vectors * values[..., None, :]) @ vectors.swapaxes(2, 3)
    np.testing.assert_allclose(made_again, stack, rtol=0, atol=1e-12)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(stack), rtol=0, atol=1e-12)


# Inside bounds -----------------------------------------------------------------------------------


@sweep("bound", [10.0, 0.3])
def test_bounded_least_squares_ends_in_the_same_place_either_way(bound: float) -> None:
    """A curved problem of a zero and two like columns; with the narrow bounds, on some of them."""
    rng = np.random.default_rng(6)
    rows = rng.normal(size=(40, 6)) * np.array([1.0, 30.0, 0.1, 0.0, 5.0, 5.0])
    rows[:, 5] = rows[:, 4]
    aim = rows @ rng.normal(size=6) + rng.normal(size=40)

    def residual(x: Array) -> Array:
        return np.append(rows @ (x + 0.1 * x**2) - aim, 1e-3 * x)

    def jacobian(x: Array) -> Array:
        return np.vstack([rows * (1.0 + 0.2 * x), 1e-3 * np.eye(6)])

    start, limits = np.zeros(6), (np.full(6, -bound), np.full(6, bound))
    tight = {"ftol": 1e-14, "xtol": 1e-10, "gtol": 1e-12, "max_nfev": 100}
    plain = least_squares(residual, start, jacobian, limits, "dogbox", **tight)
    exact = bounded_least_squares(residual, start, jacobian, limits, **tight)
    np.testing.assert_array_equal(exact.x, plain.x)
    with divide_and_conquer_gives_up() as asked:
        other = bounded_least_squares(residual, start, jacobian, limits, **tight)
    assert asked == ["dogbox"]
    assert other.success
    np.testing.assert_allclose(other.x, plain.x, rtol=0, atol=1e-6)


def test_bounded_lstsq_ends_in_the_same_place_either_way() -> None:
    rng = np.random.default_rng(7)
    matrix, targets = rng.normal(size=(30, 8)), 3.0 * rng.normal(size=30)
    low, high = np.full(8, -0.2), np.full(8, 0.3)
    exact = bounded_lstsq(matrix, targets, (low, high))
    on = (exact == low) | (exact == high)
    assert 0 < np.count_nonzero(on) < 8
    slope = matrix.T @ (matrix @ exact - targets)  # its sign on bounds, zero inside them
    np.testing.assert_allclose(slope[~on], 0.0, rtol=0, atol=1e-9)
    assert np.all(slope[exact == low] > 0.0)
    assert np.all(slope[exact == high] < 0.0)
    with divide_and_conquer_gives_up() as asked:
        other = bounded_lstsq(matrix, targets, (low, high))
    assert set(asked) <= {"lstsq", "bvls"}
    assert asked
    np.testing.assert_allclose(other, exact, rtol=0, atol=1e-7)


# What is refused ---------------------------------------------------------------------------------


@sweep("bad", [np.nan, np.inf, -np.inf])
@sweep(
    "decompose",
    [
        svd,
        lambda matrix: svd(np.stack([np.eye(4), matrix])),
        lambda matrix: lstsq(matrix, np.ones(4)),
        lambda matrix: lstsq(np.eye(4), matrix),
        lambda matrix: orth(matrix, 1e-8),
        lambda matrix: pinvh(matrix, 1e-8),
        lambda matrix: bounded_lstsq(matrix, np.ones(4), (np.zeros(4), np.ones(4))),
        eigh,
    ],
)
def test_what_is_not_finite_is_refused(bad: float, decompose: Callable[[Array], object]) -> None:
    matrix = np.eye(4)
    matrix[1, 2] = bad
    with pytest.raises(NotFiniteError, match=r"^1 of .*4 x 4 numbers .* first at \(.*1, 2\)"):
        decompose(matrix)


# The case that was met ---------------------------------------------------------------------------


def noise() -> Noise:
    sd = np.array([np.nan] * 3 + [chains.SD] * 3)
    return Noise(sd, 0.0, "repeats", np.zeros(6, dtype=np.int64), 0, False)


def laid(seed: int) -> dict[str, Whitening]:
    """Whitenings of a search on chains of springs."""
    given = chains.readings(seed)
    found = baseline.fit_baseline(given, noise(), NuisancePriors(), chains.start(given), at_once)
    return dict(found.setting.whitenings)


def test_nuisances_of_a_chain_whose_decomposition_failed_on_a_processor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """378 readings, 109 nuisances of which 18 move nothing, rank 60: `gesdd` of OpenBLAS 0.3.31
    gave up on it with the kernel SkylakeX, and no kernel may."""
    met: list[Array] = []

    def spy(matrix: Array) -> tuple[Array, Array, Array]:
        met.append(np.array(matrix))
        return svd(matrix)

    monkeypatch.setattr(whitening, "svd", spy)
    laid(8)
    assert len(met) == 3
    for matrix in met:
        assert matrix.shape == (378, 109)
        assert np.count_nonzero(~matrix.any(axis=0)) == 18
        sizes = scipy.linalg.svd(matrix, compute_uv=False, lapack_driver="gesvd")
        assert np.count_nonzero(sizes > ZERO_SHARE * sizes[0]) == 60
        assert_decomposed(matrix)


def test_a_search_stands_on_the_same_grounds_where_gesdd_gives_up() -> None:
    expected = laid(8)
    with divide_and_conquer_gives_up() as asked:
        found = laid(8)
    assert {"svd", "dogbox"} <= set(asked)
    for name, white in found.items():
        rows = np.random.default_rng(8).normal(size=(white.count, 5))
        np.testing.assert_allclose(
            white.shortened(rows), expected[name].shortened(rows), rtol=0, atol=1e-6
        )
