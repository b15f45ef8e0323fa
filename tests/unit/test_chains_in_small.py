"""Chains on densities that are written down: coordinates, starts, lengths, what is believed.

Catches a sampler's wrong step, Jacobian of coordinates or test of convergence.
"""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm
from sweeps import sweep

from spinepipe.calibration.posterior import Mode, Point, Target, _mode
from spinepipe.calibration.sampler import Convergence, _chart, _start, convergence, sample
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric


class Normal:
    """Normal about a mean, of a curvature (m, m); where a number is above ``most`` nothing is."""

    def __init__(self, mean: Array, curved: Array, most: float = np.inf) -> None:
        self.mean, self.curved, self.most = mean, curved, most
        self.unknowns = SimpleNamespace(size=len(mean))
        self.evaluations = 0
        self.seen: list[Array] = []

    def together(self, points: Sequence[tuple[int, Array]]) -> list[Point | None]:
        self.evaluations += len(points)
        self.seen += [z for _, z in points]
        return [self.at(z) for _, z in points]

    def at(self, z: Array) -> Point | None:
        away = z - self.mean
        if z.max() > self.most:
            return None
        slope = self.curved @ away
        return Point(z, z, 3.0 + 0.5 * float(away @ slope), slope, self.curved, cast(Any, None))

    @property
    def mode(self) -> Mode:
        return _mode(self.at(self.mean), "", self.curved)


def made(sds: Sequence[float], mean: Sequence[float], most: float = np.inf) -> Normal:
    return Normal(np.array(mean), np.diag(1.0 / np.square(sds)), most)


def test_a_normal_density_is_followed_to_its_quantiles() -> None:
    """Told by the data: SD 0.2 about 0.7. Each t is the z of the same share, out to 4."""
    target = made([0.2], [0.7])
    chart = _chart(cast(Target, target), target.mode)
    t = np.array([-3.5, -2.0, -1.0, 0.0, 0.5, 1.5, 3.5])
    z = np.array([chart.z(one / chart.root[0]) for one in t[:, None]])[:, 0]
    np.testing.assert_allclose(z, 0.7 + 0.2 * t, atol=0.005)
    assert chart.root[0, 0] ** 2 == pytest.approx(1.0)
    # beyond the last quantile straight on, to 30 at the farthest
    far = [float(chart.z(np.array([side * 900.0 / chart.root[0, 0]]))[0]) for side in (-1, 1)]
    near = [float(chart.z(np.array([side * 30.0 / chart.root[0, 0]]))[0]) for side in (-1, 1)]
    assert far == near
    assert (far[0], far[1]) == pytest.approx((0.7 - 6.0, 0.7 + 6.0), rel=0.1)


@sweep("sd, told", [(0.89, True), (0.91, False)])
def test_an_unknown_that_the_prior_holds_is_only_shifted(sd: float, told: bool) -> None:
    target = made([sd, 0.1], [0.2, 0.0])
    chart = _chart(cast(Target, target), target.mode)
    assert sorted(chart.quantiles) == ([0, 1] if told else [1])
    spread = np.sqrt((chart.root**2).sum(axis=1))
    np.testing.assert_allclose(spread, [1.0 if told else sd, 1.0], rtol=1e-12)
    if not told:
        np.testing.assert_allclose(chart.z(np.zeros(2)), [0.2, 0.0], atol=1e-3)


def test_looks_go_along_with_the_others_up_to_two_sds() -> None:
    """Curvature ((5, -4), (-4, 5)): variance 5/9, covariance 4/9; the other goes by 4/5."""
    target = Normal(np.array([0.1, -0.2]), np.array([[5.0, -4.0], [-4.0, 5.0]]))
    _chart(cast(Target, target), target.mode)
    away = np.array(target.seen) - target.mean
    first = away[: len(away) // 2]
    limit = 2.0 * np.sqrt(5.0 / 9.0)
    np.testing.assert_allclose(first[:, 1], 0.8 * np.clip(first[:, 0], -limit, limit), atol=1e-12)
    assert first[:, 0].min() == pytest.approx(-4.1)
    assert first[:, 0].max() == pytest.approx(3.9)
    assert (np.diff(first[:, 0]) > 0.0).all()
    # SDs of the normal one to both sides within the prior's four, and all of the prior
    sd = np.sqrt(5.0 / 9.0)
    own = [k * sd for k in (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0)]
    prior = np.array([-4.0, -3, -2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2, 3, 4]) - 0.1
    every = np.concatenate([own, -np.array(own), [0.0], prior])
    np.testing.assert_allclose(first[:, 0], np.unique(every[np.abs(every + 0.1) <= 4.0 + 1e-9]))


def test_where_nothing_stands_quantiles_end() -> None:
    target = made([0.5], [0.0], most=0.6)
    chart = _chart(cast(Target, target), target.mode)
    z = [float(chart.z(np.array([t / chart.root[0, 0]]))[0]) for t in (-1.0, 0.0, 3.9)]
    assert z[2] <= 0.6
    cut = norm.cdf(1.0)  # the last that stands is one SD out
    assert z[1] == pytest.approx(0.5 * norm.ppf(0.5 * cut), abs=0.02)
    assert z[0] == pytest.approx(0.5 * norm.ppf(norm.cdf(-1.0) * cut), abs=0.02)


@sweep("halvings", [0, 1, 3, 7])
def test_a_start_is_drawn_in_by_halves_until_it_stands(halvings: int) -> None:
    wide = 2.0 * np.random.default_rng(20011).standard_normal(3)
    reach = np.abs(wide).max() * 0.5**halvings * 1.01
    asked = []

    def slope(y: Array) -> tuple[Array, float]:
        asked.append(y)
        return y, np.inf if np.abs(y).max() > reach else 0.0

    found = _start(np.random.default_rng(20011), 3, slope)
    np.testing.assert_allclose(found, wide * 0.5**halvings)
    assert len(asked) == halvings + 1


def test_a_start_that_stands_nowhere_is_the_mode() -> None:
    asked = []

    def slope(y: Array) -> tuple[Array, float]:
        asked.append(y)
        return y, np.inf

    assert _start(np.random.default_rng(20012), 2, slope).tolist() == [0.0, 0.0]
    assert len(asked) == 8


def test_draws_of_a_normal_density_their_number_and_what_they_cost() -> None:
    """1 to 4 steps at a time, two and a half on average; seven of ten ends are taken or more."""
    target = Normal(np.array([0.3, -0.1]), np.array([[30.0, 10.0], [10.0, 20.0]]))
    found = sample(cast(Target, target), target.mode, 3, 40, 140, seed=20013)
    assert found.z.shape == (3, 140, 2)
    assert 0.55 < found.accepted < 0.95
    # one question per step, and a few at quantiles and to begin with
    assert 2.2 * 540 < found.evaluations < 3.0 * 540
    assert found.evaluations == target.evaluations
    draws = found.z.reshape(-1, 2)
    covariance = np.linalg.inv(target.curved)
    sds = np.sqrt(np.diagonal(covariance))
    assert (np.abs(draws.mean(axis=0) - target.mean) < 0.25 * sds).all()
    np.testing.assert_allclose(draws.std(axis=0), sds, rtol=0.2)
    assert np.cov(*draws.T)[0, 1] == pytest.approx(covariance[0, 1], rel=0.4)
    assert not np.allclose(found.z[0, :5], found.z[1, :5])  # each chain has its own seed
    before = target.evaluations
    again = sample(cast(Target, target), target.mode, 1, 5, 5, seed=20013)
    assert again.evaluations == target.evaluations - before


@sweep(
    "r_hat, bulk, tail, words",
    [
        (1.01, 400.0, 400.0, []),
        (1.0101, 400.0, 400.0, ["R-hat is 1.010, allowed 1.01"]),
        (1.0, 399.0, 400.0, ["the effective size is 399, at least 400 needed"]),
        (1.0, 900.0, 398.0, ["the effective size is 398, at least 400 needed"]),
        (1.2, 10.0, 5.0, ["R-hat is 1.200, allowed 1.01", "the effective size is 5, at least"]),
        (np.nan, 400.0, 400.0, ["R-hat is nan"]),
        (1.0, np.nan, 500.0, ["the effective size is nan"]),
        (1.0, 500.0, np.nan, ["the effective size is nan"]),
    ],
)
def test_what_chains_must_reach(r_hat: float, bulk: float, tail: float, words: list[str]) -> None:
    """Vehtari 2021; the worst of all quantities counts."""
    good = np.array([1.0, 5000.0, 5000.0])
    for rows in ([[r_hat, bulk, tail], good], [good, [r_hat, bulk, tail]]):
        message = Convergence(*np.array(rows).T).message
        assert all(word in message for word in words)
        assert message.endswith("; take more draws" if words else "")
        assert (message == "") is (not words)


def test_a_quantity_that_does_not_vary_has_converged() -> None:
    rng = np.random.default_rng(20014)
    found = convergence([np.full((2, 30), 7.0), rng.normal(size=(2, 500))])
    assert (found.r_hat[0], found.ess_bulk[0], found.ess_tail[0]) == (1.0, 60.0, 60.0)
    assert found.r_hat[1] == pytest.approx(1.0, abs=0.02)


def test_the_effective_size_of_the_tails_is_that_of_the_share_beyond_the_fifth_and_95th() -> None:
    """Sizes stay for twenty draws, signs do not: of what is far out less is known."""
    rng = np.random.default_rng(20015)
    size = np.repeat(rng.choice([0.1, 3.0], p=[0.9, 0.1], size=(4, 50)), 20, axis=1)
    values = size * rng.choice([-1.0, 1.0], size=size.shape) + 1e-3 * rng.normal(size=size.shape)
    found = convergence([values])
    assert found.ess_bulk[0] > 2.5 * found.ess_tail[0]
    flipped = convergence([np.exp(values)])  # ranks are all that counts
    assert flipped.ess_bulk[0] == pytest.approx(found.ess_bulk[0], rel=1e-9)
    assert flipped.ess_tail[0] == pytest.approx(found.ess_tail[0], rel=1e-9)
