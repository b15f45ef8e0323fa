"""Where a region's end is looked for, look by look, on costs whose rise is written down.

Catches an end of a region looked for on the wrong side, or given up too soon.
"""

from collections.abc import Callable

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.calibration.profile import Best, Profile, _one_step, profile_in_turn
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric

Root = Callable[[float], float]
"""Root of the share of the rise allowed, by the way from the optimum."""


def as_is(way: float) -> float:
    return way


def looked(
    root: Root, ahead: float = 1.0, bound: float = 50.0, slope: float = 1.0, scale: float = 1.0
) -> tuple[list[float], Profile]:
    """Looks above an optimum at 3, and what comes of them; nothing is free below it.

    The rise allowed is 4, of a cost of 7; an end as the optimum's slope has it is 2 / slope away.
    """
    looks = []

    def point(x: Array) -> tuple[Array, Array] | None:
        looks.append(float(x[0]) - 3.0)
        size = root((x[0] - 3.0) / 2.0)
        return None if np.isnan(size) else (np.sqrt([7.0, 4.0 * size * abs(size)]), nothing)

    nothing = np.zeros((2, 1))
    best = Best(
        x=np.array([3.0]),
        residual=np.sqrt([7.0, 0.0]),
        jacobian=np.array([[0.0], [slope]]),
        lower=np.array([3.0]),
        upper=np.array([3.0 + bound]),
        scale=np.array([scale]),
        bent=np.zeros(1, dtype=bool),
        ahead=ahead,
    )
    return looks, profile_in_turn(best, point, [0], limit=2.0)


@sweep(
    "ahead, ways",
    [
        (1.02, [1.02]),  # an end a little beyond is one
        (1.1, [1.1, 1.0]),  # too far: back to where a straight root has it
        (0.99, [0.99, 1.089, 1.0]),  # not quite: at least a tenth further, as it must lie between
        (0.9, [0.9, 1.02]),  # not far enough: a little beyond what is expected
        (0.2, [0.2, 0.6, 1.02]),  # three times as far at most
        (0.05, [0.05, 0.15, 0.45, 25.0, 1.6775, 1.0]),  # and after three looks the bound
    ],
)
def test_looks_at_a_cost_that_is_a_square(ahead: float, ways: list[float]) -> None:
    """Between 0.45 and 25 a look is at least a twentieth of the way."""
    looks, found = looked(as_is, ahead)
    np.testing.assert_allclose(looks, 2.0 * np.array(ways), rtol=1e-9)
    assert found.high[0] == 3.0 + looks[-1]
    assert not found.open_above[0]
    assert (found.open_below[0], found.low[0]) == (True, 3.0)
    assert not found.lower_cost


@sweep("bound, looks", [(1.9, [1.9]), (0.3, [0.3]), (0.0, [])])
def test_a_region_that_reaches_its_bound_is_open(bound: float, looks: list[float]) -> None:
    seen, found = looked(as_is, bound=bound)
    np.testing.assert_allclose(seen, looks, rtol=1e-12)
    assert found.open_above[0]
    assert found.high[0] == 3.0 + bound


def test_a_bound_behind_the_end_closes_the_region() -> None:
    seen, found = looked(as_is, ahead=1.5, bound=2.02)
    assert not found.open_above[0]
    assert found.high[0] == pytest.approx(5.02)
    assert seen == [pytest.approx(2.02)]


def test_before_a_wall_the_way_is_halved_and_the_last_that_stands_not_taken() -> None:
    """Nothing stands from 0.6 on: eight looks, the end is the nearest of them beyond it.

    Where nothing stands the optimum's own values of the others are tried too: two looks.
    """
    looks, found = looked(lambda way: way if way < 0.6 else np.nan)
    ways = [1.0, 0.5, 0.75, 0.625, 0.5625, 0.59375, 0.609375, 0.6015625]
    twice = [2.0 * way for way in ways for _ in range(1 + (way > 0.6))]
    np.testing.assert_allclose(looks, twice, rtol=1e-12)
    assert found.high[0] == 3.0 + 2.0 * 0.6015625
    assert not found.open_above[0]


def test_looks_that_keep_falling_short_are_halved() -> None:
    """3 at 1 and 0.1 before: after two in a row on one side, half way between."""
    looks, _ = looked(lambda way: 3.0 if way > 0.95 else 0.1)
    first = 1.0 / 3.0
    second = first + (1.0 - first) * 0.9 / 2.9
    third = 0.5 * (1.0 + second)
    fourth = 0.5 * (1.0 + third)
    np.testing.assert_allclose(looks[:5], 2.0 * np.array([1.0, first, second, third, fourth]))
    assert len(looks) == 8


def test_looks_that_keep_falling_beyond_are_halved() -> None:
    """1.5 from 0.02 on: the root's first part, two more beyond, then half way to the optimum."""
    looks, found = looked(lambda way: 1.5 if way > 0.02 else 0.0)
    part = 1.0 / 1.5
    ways = [1.0, part, part**2, 0.5 * part**2, 0.25 * part**2, 0.125 * part**2]
    np.testing.assert_allclose(looks[:6], 2.0 * np.array(ways))
    assert len(looks) == 8
    assert found.high[0] > 3.0 + 2.0 * 0.02


def test_a_side_that_changes_is_not_halved() -> None:
    """Beyond, short, beyond, short: each look is where a straight root has it."""
    roots = iter([2.0, 0.5, 1.6, 0.8, 1.3])
    looks, _ = looked(lambda way: next(roots, 1.0))
    short = 0.5
    beyond = short + (1.0 - short) * 0.5 / 1.5
    again = short + (beyond - short) * 0.5 / 1.1
    last = again + (beyond - again) * 0.2 / 0.8
    np.testing.assert_allclose(looks[:5], 2.0 * np.array([1.0, short, beyond, again, last]))


@sweep("dip, lower", [(0.04, False), (0.06, True), (0.5, True)])
def test_a_cost_below_the_optimums_is_said(dip: float, lower: bool) -> None:
    """By more than an end is known to; shares of the rise allowed, at the second look of four."""

    def root(way: float) -> float:
        return -np.sqrt(dip) if 0.1 < way < 0.4 else way

    looks = []

    def point(x: Array) -> tuple[Array, Array]:
        looks.append(float(x[0]))
        size = root(float(x[0]))
        return np.sqrt([7.0 + size * abs(size)]), np.zeros((1, 1))

    best = Best(
        *(np.zeros(1), np.sqrt([7.0]), np.ones((1, 1)), np.zeros(1), np.full(1, 9.0)),
        *(np.ones(1), np.zeros(1, dtype=bool)),
        ahead=0.3,
    )
    found = profile_in_turn(best, point, [0], limit=1.0)
    assert found.lower_cost is lower
    assert not found.closed[0]  # it begins at its lower bound
    assert not found.open_above[0]


def test_a_way_below_what_an_optimum_is_known_to_is_not_looked_at() -> None:
    """A millionth of a typical change."""
    looks, found = looked(as_is, slope=2.2e6)
    assert looks == []
    assert found.high[0] == pytest.approx(3.0 + 2.0 / 2.2e6, abs=1e-12)
    assert not found.open_above[0]
    assert looked(as_is, slope=1.8e6)[0]
    assert looked(as_is, slope=2.2e6, scale=0.5)[0]
    assert not looked(as_is, slope=1.2e6, scale=2.0)[0]
    _, short = looked(as_is, slope=2.2e6, bound=1e-7)
    assert short.high[0] == 3.0 + 1e-7


@sweep("side", [-1.0, 1.0])
@sweep("ahead, ways", [(1.02, [1.02]), (1.1, [1.1, 1.0]), (0.9, [0.9, 1.02])])
def test_the_same_looks_at_a_logarithm_are_straight_in_one_over_the_stiffness(
    side: float, ahead: float, ways: list[float]
) -> None:
    """u = exp(-x), read as 5 u; 0.4 of u are allowed."""
    looks = []

    def point(x: Array) -> tuple[Array, Array]:
        looks.append(float(x[0]))
        return 5.0 * (np.exp(-x) - 1.0), -5.0 * np.exp(-x)[:, None]

    low, high = (np.zeros(1), np.full(1, 4.0)) if side > 0 else (np.full(1, -4.0), np.zeros(1))
    best = Best(
        *(np.zeros(1), *point(np.zeros(1)), low, high, np.ones(1), np.ones(1, dtype=bool)),
        ahead=ahead,
    )
    looks.clear()
    found = profile_in_turn(best, point, [0], limit=2.0)
    np.testing.assert_allclose(np.exp(-np.array(looks)), 1.0 - side * 0.4 * np.array(ways))
    end = found.high[0] if side > 0 else found.low[0]
    assert end == looks[-1]


def test_a_logarithm_whose_stiffness_would_be_beyond_all_is_looked_for_at_its_bound() -> None:
    """1.02 of a way that leads to u below zero."""
    looks = []

    def point(x: Array) -> tuple[Array, Array]:
        looks.append(float(x[0]))
        return np.exp(-x) - 1.0, -np.exp(-x)[:, None]

    best = Best(
        *(np.zeros(1), *point(np.zeros(1)), np.zeros(1), np.full(1, 6.0), np.ones(1)),
        np.ones(1, dtype=bool),
    )
    looks.clear()
    found = profile_in_turn(best, point, [0], limit=1.0)
    assert looks == [6.0]
    assert found.open_above[0]


@sweep("unseen", [False, True])
def test_ends_of_two_that_make_up_for_one_another(unseen: bool) -> None:
    """Of straight readings each end is at SD times limit, and the other is fitted there."""
    matrix = np.array([[1.0, 0.9], [0.0, 0.5], [2.0, 2.1], [1.0, -0.3]])
    if unseen:
        matrix[:, 1] = 3.0 * matrix[:, 0] + np.array([1e-7, 0.0, 0.0, 0.0])
    x, far = np.array([0.3, -0.2]), np.full(2, 90.0)
    looks = []

    def point(at: Array) -> tuple[Array, Array]:
        looks.append(at)
        return matrix @ (at - x), matrix

    best = Best(x, *point(x), -far, far, np.ones(2), np.zeros(2, dtype=bool), ahead=1.01)
    looks.clear()
    found = profile_in_turn(best, point, [1])
    assert (found.open_below[0], found.open_above[0]) == (True, True)
    assert (found.low[0], found.high[0]) == (-90.0, 90.0)
    assert found.closed.tolist() == [False, not unseen]
    if unseen:
        assert looks == []
        return
    covariance = np.linalg.inv(matrix.T @ matrix)
    way = 1.01 * 1.959964 * np.sqrt(covariance[1, 1])
    assert (found.low[1], found.high[1]) == pytest.approx((-0.2 - way, -0.2 + way), rel=1e-6)
    for look, side in zip(looks, (-1, 1), strict=True):
        slope = covariance[0, 1] / covariance[1, 1]
        np.testing.assert_allclose(look, x + side * way * np.array([slope, 1.0]), rtol=1e-6)
    assert best.told_by(1) == pytest.approx(1.0 / np.sqrt(covariance[1, 1]))
    assert best.others(1).tolist() == [0]


def test_a_start_where_nothing_stands_gives_way_to_that_of_the_last_fit() -> None:
    """The other would follow by 1; beyond 0.5 it tips, and the fit goes on from where it was."""
    matrix = np.array([[1.0, -1.0], [1.0, 0.0]])

    def point(at: Array) -> tuple[Array, Array] | None:
        return None if at[1] > 0.5 else (matrix @ at, matrix)

    far = np.full(2, 9.0)
    origin, straight = np.zeros(2), np.zeros(2, dtype=bool)
    best = Best(origin, np.zeros(2), matrix, -far, far, np.ones(2), straight)
    found = profile_in_turn(best, point, [0], limit=1.0)
    assert found.closed[0]
    assert -found.low[0] == pytest.approx(1.0, rel=0.03)
    assert found.high[0] <= 1.02


@sweep("along", [False, True])
def test_the_others_stay_inside_their_bounds(along: bool) -> None:
    """x + y and x are read, y is 0.3 at most in size: beyond, the cost is x^2 + (x - 0.3)^2."""
    matrix, far = np.array([[1.0, 1.0], [1.0, 0.0]]), np.array([9.0, 0.3])

    def point(at: Array) -> tuple[Array, Array]:
        return matrix @ at, matrix

    best = Best(
        *(np.zeros(2), *point(np.zeros(2)), -far, far, np.ones(2), np.zeros(2, dtype=bool)),
        along_bounds=along,
    )
    found = profile_in_turn(best, point, [0], limit=1.0)
    end = (0.3 + np.sqrt(2.0 - 0.09)) / 2.0
    assert (found.high[0], -found.low[0]) == pytest.approx((end, end), rel=0.03)


@sweep("pull, looks, end", [(0.2, 1, 1.0), (0.6, None, 0.8602)])
def test_one_linear_step_is_believed_where_it_gains_little(
    pull: float, looks: int | None, end: float
) -> None:
    """x and p x + y + 40 y^2 are read: a straight step makes up for all of p x, of which it can
    1/160. With p = 0.2 that is 0.04 of the rise, below a tenth, with 0.6 it is 0.36: then
    x^2 + (0.6 x - 1/160)^2 = 1 is the end."""
    asked = []

    def point(at: Array) -> tuple[Array, Array]:
        x, y = at
        asked.append(x)
        slopes = np.array([[1.0, 0.0], [pull, 1.0 + 80.0 * y]])
        return np.array([x, pull * x + y + 40.0 * y**2]), slopes

    low, high = np.array([0.0, -9.0]), np.full(2, 9.0)
    origin, straight = np.zeros(2), np.zeros(2, dtype=bool)
    best = Best(origin, np.zeros(2), np.eye(2), low, high, np.ones(2), straight)
    found = profile_in_turn(best, point, [0], limit=1.0)
    assert found.high[0] == pytest.approx(end, rel=0.03)
    assert looks is None or len(asked) == looks


def test_one_linear_step_ends_where_the_cost_is_least_within_bounds() -> None:
    """Of (a - 2)^2 + (b + a - 3)^2: 0 at (2, 1); where a is 1.5 at most, 0.25 at (1.5, 1.5)."""
    jacobian = np.array([[1.0, 0.0], [1.0, 1.0]])
    start = np.array([0.5, 0.25])
    residual = jacobian @ start - np.array([2.0, 3.0])
    cost, there = _one_step(residual, jacobian, start, None)
    assert cost == pytest.approx(0.0, abs=1e-20)
    np.testing.assert_allclose(there, [2.0, 1.0])
    bounds = np.array([-1.0, -1.0]), np.array([1.5, 9.0])
    for scale in (np.ones(2), np.array([0.1, 30.0])):
        cost, there = _one_step(residual, jacobian, start, (bounds, scale))
        assert cost == pytest.approx(0.25, rel=1e-6)
        np.testing.assert_allclose(there, [1.5, 1.5], rtol=1e-6)
        assert there[0] <= 1.5
    bounds = np.array([2.5, -1.0]), np.array([4.0, 9.0])
    start = np.array([3.0, 0.25])
    cost, there = _one_step(jacobian @ start - [2.0, 3.0], jacobian, start, (bounds, np.ones(2)))
    assert (cost, *there) == pytest.approx((0.25, 2.5, 0.5), rel=1e-6)
    cost, there = _one_step(np.array([3.0, 4.0]), np.zeros((2, 0)), np.zeros(0), None)
    assert (cost, len(there)) == (25.0, 0)
