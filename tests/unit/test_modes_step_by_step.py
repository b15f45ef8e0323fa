"""Modes of densities that are written down: each step, what ends a search, what is asked for.

Catches a search for a mode that ends too soon, too late or at none.
"""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from spinepipe.calibration import posterior
from spinepipe.calibration.posterior import (
    NOT_LEVEL,
    SADDLE,
    TIPPED,
    Point,
    ResidualNoise,
    Target,
    between,
    modes,
    noise_of,
    normal_of,
)
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric

Energy = Callable[[Array], tuple[float, Array] | None]
"""Energy and gradient (m,) at z (m,)."""


class Made:
    """A target whose curvature after Gauss and Newton is 1, and every question it was asked."""

    def __init__(self, energy: Energy, size: int) -> None:
        self.energy, self.unknowns = energy, SimpleNamespace(size=size)
        self.asked: list[tuple[int, Array]] = []

    def together(self, points: Sequence[tuple[int, Array]]) -> list[Point | None]:
        self.asked += [(number, z) for number, z in points]
        return [self._at(z) for _, z in points]

    def _at(self, z: Array) -> Point | None:
        found = self.energy(z)
        if found is None:
            return None
        energy, gradient = found
        return Point(z, z, energy, gradient, np.eye(len(z)), cast(Any, None))

    def along(self) -> list[float]:
        """The first number of each question."""
        return [float(z[0]) for _, z in self.asked]


def modes_of(made: Made, *starts: float) -> list[posterior.Mode]:
    return modes(cast(Target, made), np.array(starts)[:, None])


def bowl(z: Array) -> tuple[float, Array]:
    return 0.5 * float(z @ z), z


def test_damping_is_a_thousandth_at_first_and_halved_after_each_step_down() -> None:
    """Of a linear slope each step is 1 / (1 + d), and no step is the last."""
    made = Made(lambda z: (float(z[0]), np.ones(1)), 1)
    found = modes_of(made, 0.0)[0]
    assert (found.point, found.message) == (None, NOT_LEVEL)
    steps = -np.diff(made.along())
    np.testing.assert_allclose(steps, 1.0 / (1.0 + 1e-3 * 0.5 ** np.arange(len(steps))))
    assert len(steps) == 200
    assert "200 steps" in NOT_LEVEL


def test_damping_is_four_hundredths_after_a_step_up_and_fourfold_after_more() -> None:
    """The slope points out of where anything stands: no end is believed while damping is above 1.

    Below that a step of s = 1 / (1 + d) would gain s / 2.
    """
    made = Made(lambda z: None if z[0] < 0.0 else (float(z[0]), np.ones(1)), 1)
    modes_of(made, 0.0)
    damping = np.concatenate([[1e-3], 0.04 * 4.0 ** np.arange(9)])
    np.testing.assert_allclose(made.along()[1:11], -1.0 / (1.0 + damping))


def test_a_step_that_stays_level_is_none() -> None:
    made = Made(lambda z: (0.0, np.ones(1)), 1)
    modes_of(made, 0.0)
    np.testing.assert_allclose(made.along()[1:3], [-1.0 / 1.001, -1.0 / 1.04])


@pytest.mark.parametrize(("start", "looks"), [(0.044, 1), (0.0455, 2), (-0.044, 1), (-0.0455, 2)])
def test_a_mode_is_where_a_step_gains_less_than_a_thousandth(start: float, looks: int) -> None:
    """z^2 / 2 would be gained; then come two looks at the gradient for its curvature."""
    made = Made(bowl, 1)
    found = modes_of(made, start)[0]
    assert len(made.asked) == looks + 2
    at = start if looks == 1 else start * 1e-3 / 1.001
    np.testing.assert_allclose(made.along()[looks:], [at + 1e-3, at - 1e-3])
    assert found.point is not None
    assert found.message == ""
    assert found.point.z[0] == pytest.approx(at)
    assert found.covariance[0, 0] == pytest.approx(1.0)
    assert found.log_evidence == pytest.approx(-0.5 * at**2, abs=1e-9)


def test_a_mode_while_damping_is_above_1_is_not_believed() -> None:
    """Nothing stands but at the start: damping 0.001, 0.04, 0.16, 0.64, 2.56, ...

    A slope of 0.05 gains 0.00125 / 1.16, more than a thousandth; at 0.64 it would gain less.
    """
    made = Made(lambda z: (0.05 * z[0], np.full(1, 0.05)) if z[0] == 0.0 else None, 1)
    found = modes_of(made, 0.0)[0]
    assert found.message == TIPPED.replace("begins", "ends")
    assert len(made.asked) == 4 + 2
    steep = Made(lambda z: (0.07 * z[0], np.full(1, 0.07)) if z[0] == 0.0 else None, 1)
    assert modes_of(steep, 0.0)[0].message == NOT_LEVEL
    assert len(steep.asked) == 201


def test_the_curvature_is_that_of_the_gradient_made_symmetric() -> None:
    """Gradient z -> A z + (z_0^2, 0), at nought: central differences see nothing of the square."""
    matrix = np.array([[4.0, 1.5], [0.5, 9.0]])
    made = Made(lambda z: (float(z @ z), matrix @ z + [z[0] ** 2, 0.0]), 2)
    found = modes(cast(Target, made), np.zeros((1, 2)))[0]
    expected = np.linalg.inv([[4.0, 1.0], [1.0, 9.0]])
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-9)
    np.testing.assert_allclose(np.abs([z for _, z in made.asked[1:]]).sum(axis=1), 1e-3)


def test_each_search_keeps_its_number_and_says_why_it_has_no_mode() -> None:
    def energy(z: Array) -> tuple[float, Array] | None:
        if z[0] < -5.0:
            return None
        return (0.5 * float(z @ z), z) if z[0] < 5.0 else (-0.5 * float(z @ z), 1e-3 * (7.0 - z))

    made = Made(energy, 1)
    found = modes_of(made, -9.0, 0.01, 7.0, 2.0)
    assert [one.message for one in found] == [TIPPED, "", SADDLE, ""]
    assert [one.point is None for one in found] == [True, False, True, False]
    assert found[3].point is not None
    assert abs(found[3].point.z[0]) < 0.01
    assert [number for number, _ in made.asked] == [0, 1, 2, 3, 3, 1, 1, 2, 2, 3, 3]
    assert all(one.log_evidence == -np.inf for one in (found[0], found[2]))


class Straight:
    """Unknowns twice as large as their numbers."""

    size = 1

    def at(self, numbers: Sequence[int], z: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        return 2.0 * z, np.full((len(z), 1, 1), 2.0), z[:, 0] != 0.25


class Evaluated:
    """An evaluator whose residuals are 3 x - 1 and x, between bounds of 2."""

    def __init__(self) -> None:
        self.problem = SimpleNamespace(
            lower=np.full(1, -2.0), upper=np.full(1, 2.0), weights=np.array([1.0, 4, 0, 1, 1, 9])
        )
        self.coordinate = np.array([1, 5])
        self.calls: list[str] = []

    def forget(self) -> None:
        self.calls.append("forget")

    def together(self, points: Sequence[tuple[int, Array]]) -> list[Any]:
        self.calls.append(" ".join(f"{number}:{x[0]:g}" for number, x in points))
        return [
            SimpleNamespace(
                residual=None if x[0] == 1.5 else np.array([3.0 * x[0] - 1.0, x[0]]),
                jacobian=np.array([[3.0], [1.0]]),
            )
            for _, x in points
        ]


def target() -> tuple[Target, Evaluated]:
    evaluator, noise = (
        Evaluated(),
        ResidualNoise(np.array([1.0, 0.25, 1, 1, 1, 4.0]), np.array([1, 5])),
    )
    return Target(cast(Any, evaluator), Straight(), noise), evaluator


def test_an_energy_is_that_of_likelihood_and_prior() -> None:
    found = target()[0].at(np.array([0.5]))
    assert found is not None
    log = norm.logpdf(2.0, scale=0.5) + norm.logpdf(1.0, scale=2.0) + norm.logpdf(0.5)
    assert found.energy == pytest.approx(-log - 0.5 * np.log(2.0 * np.pi))
    # by z: 2 of x, so 6 and 2 of the residuals, which are 2 and 1, of variance 1/4 and 4
    assert found.gradient[0] == pytest.approx(6.0 * 2.0 / 0.25 + 2.0 * 1.0 / 4.0 + 0.5)
    assert found.bend[0, 0] == pytest.approx(36.0 / 0.25 + 4.0 / 4.0 + 1.0)
    assert (found.x[0], found.z[0]) == (1.0, 0.5)


def test_points_beyond_bounds_or_without_a_model_are_not_asked_for() -> None:
    """At a bound they are; what tips is asked for and has no density."""
    made, evaluator = target()
    z = [-1.0, 1.0, -1.01, 1.01, 0.25, 0.75, 0.1]
    found = made.together([(10 + k, np.array([one])) for k, one in enumerate(z)])
    assert [one is not None for one in found] == [True, True, False, False, False, False, True]
    assert evaluator.calls == ["10:-2 11:2 15:1.5 16:0.2"]
    assert made.evaluations == 4
    assert made.together([(0, np.array([3.0]))]) == [None]
    assert len(evaluator.calls) == 1


def test_what_was_seen_is_forgotten_after_so_many_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posterior, "REMEMBERED", 4)
    made, evaluator = target()
    for count in (3, 1, 1, 3, 2):
        made.together([(0, np.array([0.01 * k])) for k in range(count)])
    assert [call == "forget" for call in evaluator.calls] == [
        *(False, False, True),  # the fifth
        *(False, False, True, False),  # counted from the fifth on
    ]
    assert made.evaluations == 10


def test_a_variance_is_of_the_weighted_reading_and_of_the_scatter() -> None:
    """mm and degrees: an error of 1 mm is 1, of 1 degree 1, each squared times its weight."""
    sd = np.array([5e-3, 2e-3, 1.0, 0.1, 0.1, np.deg2rad(3.0)])
    found = noise_of(cast(Any, Evaluated()), sd, 0.5)
    assert found.variance[[1, 5]] == pytest.approx([4.0 * 4.0 + 0.25, 9.0 * 9.0 + 0.25])
    assert found.variance[2] == pytest.approx(0.25)
    assert found.coordinate.tolist() == [1, 5]
    unread = np.array([0.0, 1e-3, 0.0, 0.0, 0.0, 0.1])
    assert noise_of(cast(Any, Evaluated()), unread, 0.0).variance[0] == 0.0
    with pytest.raises(ValueError, match="neither"):
        noise_of(cast(Any, Evaluated()), np.array([1.0, 1, 1, 1, 1, 0]), 0.0)


def test_numbers_between_bounds_are_uniform_for_standard_normal_ones() -> None:
    low, high = np.array([-1.0, 10.0]), np.array([3.0, 12.0])
    z = np.array([[0.0, 0.0], [1.6448536, -1.6448536], [40.0, -40.0]])
    x, slope = between(low, high, z)
    np.testing.assert_allclose(x, [[1.0, 11.0], [2.8, 10.1], [3.0, 10.0]], rtol=1e-7)
    np.testing.assert_allclose(slope[0], [4.0 * 0.3989423, 2.0 * 0.3989423], rtol=1e-6)
    np.testing.assert_allclose(slope[1], [4.0 * 0.1031356, 2.0 * 0.1031356], rtol=1e-6)
    np.testing.assert_allclose(normal_of(low, high, x[:2]), z[:2], rtol=1e-6, atol=1e-12)
    # at a bound as at a millionth of the way: 4.753 SDs out
    ends = normal_of(low, high, np.array([-1.0, 12.0]))
    np.testing.assert_allclose(ends, [-4.753424, 4.753424], rtol=1e-6)
