"""Whitened readings against covariances that are written out, reading by reading."""

from functools import cache

import numpy as np
from held_out_cases import CORRELATION, SD, cases, noise

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.search.whitening import (
    Whitening,
    joined,
    whitening,
    with_nuisances,
)

CYCLES, STEPS, JOINTS, NUISANCES = 3, 6, 2, 4
SHAPE = (STEPS, JOINTS, 6)
CLOSE = 1e-9
"""Of numbers of order one, after a dozen inversions of matrices that are far from singular."""

Place = tuple[int, int, int, int]
"""Test, load step, joint, coordinate."""


@cache
def recorded() -> tuple[Repeats, ...]:
    """Two tests; some readings are missing in some cycles, some in all of them."""
    rng = np.random.default_rng(4)
    made = []
    for case in cases(("flexion", "bending")):
        cycles = rng.normal(size=(CYCLES, *SHAPE))
        cycles[rng.random(cycles.shape) < 0.25] = np.nan
        cycles[:, 2, 0, 4] = np.nan
        cycles[..., :3] = np.nan
        made.append(Repeats(case, cycles))
    return tuple(made)


@cache
def moved() -> tuple[Array, ...]:
    """Per test (T, J, 6, K) by one prior SD; the last nuisance does what the first does."""
    rng = np.random.default_rng(5)
    both = 3.0 * SD * rng.normal(size=(2, *SHAPE, NUISANCES))
    both[..., -1] = 0.5 * both[..., 0]
    return tuple(both)


def places() -> list[Place]:
    """Of all readings, in the order of whitened ones."""
    return [
        (n, *map(int, at)) for n, test in enumerate(recorded()) for at in np.argwhere(test.count)
    ]


def written_out() -> Array:
    """(N, N) covariance of the means by noise: along the load steps of one joint's coordinate."""
    found = np.zeros((len(places()), len(places())))
    for row, (test, step, joint, coordinate) in enumerate(places()):
        for column, (other, later, *same) in enumerate(places()):
            if other == test and same == [joint, coordinate]:
                counts = (recorded()[test].count[t, joint, coordinate] for t in (step, later))
                shared = SD**2 * CORRELATION ** abs(step - later)
                found[row, column] = shared / np.sqrt(np.prod(list(counts)))
    return found


def listed(rows: tuple[Array, ...]) -> Array:
    """(N, ...) of rows per test (T, J, 6, ...)."""
    return np.array([rows[test][step, joint, at] for test, step, joint, at in places()])


def by_hand() -> tuple[Whitening, Array, Array]:
    """Whitening with nuisances, inverse root (N, N) of the noise, whitened moves (N, K)."""
    plain = whitening(recorded(), noise())
    units = np.eye(len(places()))
    columns = tuple(np.zeros((*SHAPE, len(units))) for _ in recorded())
    for number, (test, step, joint, coordinate) in enumerate(places()):
        columns[test][step, joint, coordinate] = units[number]
    root = plain.noise_only(columns)
    return with_nuisances(plain, moved()), root, root @ listed(moved())


def test_noise_has_variance_one_and_no_correlation() -> None:
    _, root, _ = by_hand()
    np.testing.assert_allclose(root @ written_out() @ root.T, np.eye(len(root)), atol=CLOSE)


def test_noise_and_nuisances_together_have_variance_one() -> None:
    white, root, moves = by_hand()
    whole = written_out() + listed(moved()) @ listed(moved()).T
    both = white.shortened(root)
    np.testing.assert_allclose(both @ whole @ both.T, np.eye(len(root)), atol=CLOSE)
    np.testing.assert_allclose(white(moved()), white.shortened(moves), atol=CLOSE)
    np.testing.assert_allclose(white.moves, moves, atol=CLOSE)
    expected = np.linalg.svd(moves, compute_uv=False)[: NUISANCES - 1]
    np.testing.assert_allclose(np.sort(white.sizes)[::-1], expected, rtol=CLOSE)


def test_what_is_shortened_is_lengthened_again() -> None:
    white, root, _ = by_hand()
    np.testing.assert_allclose(white.lengthened(white.shortened(root)), root, atol=CLOSE / SD)
    column = root[:, 3]
    np.testing.assert_allclose(white.lengthened(white.shortened(column)), column, atol=CLOSE / SD)


def test_what_is_left_over_is_beside_the_most_likely_nuisances() -> None:
    white, _, moves = by_hand()
    residual = np.random.default_rng(6).normal(size=len(moves))
    likely = np.linalg.solve(np.eye(NUISANCES) + moves.T @ moves, moves.T @ residual)
    np.testing.assert_allclose(white.left_over(residual), residual - moves @ likely, atol=CLOSE)
    expected = np.diagonal(np.linalg.inv(np.eye(len(moves)) + moves @ moves.T))
    np.testing.assert_allclose(white.freedom, expected, atol=CLOSE)


def test_readings_of_both_are_one_behind_the_other() -> None:
    white, root, moves = by_hand()
    halves = [whitening([test], noise()) for test in recorded()]
    both = joined(halves[0], halves[1], moves)
    np.testing.assert_allclose(both.shortened(root), white.shortened(root), atol=CLOSE / SD)
    np.testing.assert_allclose(both.noise_only(moved()), moves, atol=CLOSE)
