"""Posteriors of springs under known loads against quadrature of their own closed forms.

Catches a density, gradient or sampler whose draws are not those of the closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from example_effects import NOWHERE, spine
from scipy.interpolate import PchipInterpolator
from scipy.stats import norm
from sweeps import sweep

from spinepipe.calibration import Evaluator, MeasuredCase, Problem
from spinepipe.calibration.posterior import (
    Point,
    Target,
    _mode,
    between,
    modes,
    noise_of,
    normal_of,
)
from spinepipe.calibration.sampler import OUTERMOST, _Chart, convergence, sample
from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, LoadStep, ScopedEffect
from spinepipe.statics import free_parameters
from spinepipe.units import DEG_PER_RAD

pytestmark = pytest.mark.numeric

EXTENSION = 3
FORCES_N = np.array([1.0, 2.0, 3.0])
ARM_M = 0.05
SD_M = 0.01
"""Of where the centre is, anterior: a fifth of the arm."""
REACH = np.log(10.0)
NOISE_RAD = 2e-3


@dataclass(frozen=True)
class Lever:
    """z: a stiffness, uniform in its logarithm, and the anterior offset of the joint's centre."""

    low: Array
    high: Array
    size: int = 2

    def at(self, numbers: Sequence[int], z: Array) -> tuple[Array, Array, Array]:
        moves, slopes = between(self.low, self.high, z[:, :1])
        jacobian = np.zeros((len(z), 2, 2))
        jacobian[:, 0, 0], jacobian[:, 1, 1] = slopes[:, 0], SD_M
        return np.hstack([moves, SD_M * z[:, 1:]]), jacobian, np.ones(len(z), dtype=bool)


def lever(theta: Array) -> tuple[Target, float]:
    """A joint that cannot but turn, forces straight down in front of it; extension theta (T,) rad.

    What else the joint could do is held by springs a million times as stiff. Rotations are below
    0.02 rad: that the arm turns with them changes it by 2e-4.
    """
    upright = (Pose(np.eye(3), np.zeros(3)),)
    model = replace(spine(1, gravity=False), frames=upright)
    values = np.array([[1e9, 1e9, 1e9, 60.0, 1e6, 1e6]])
    bushing = model.effects[0].with_values(values)
    offset = ScopedEffect(create("joint_centre_offset"), (0,), np.zeros((1, 3)))
    model = model.with_effects((bushing, offset))
    point = np.array([ARM_M, 0.0, 0.0])
    steps = tuple(
        LoadStep(n, (Wrench(0, point, np.array([0.0, -force, 0.0]), NOWHERE),))
        for n, force in enumerate(FORCES_N)
    )
    measured = np.full((len(FORCES_N), 1, 6), np.nan)
    measured[:, 0, EXTENSION] = theta
    free = (
        *free_parameters(model, 0, ("extension_nm_per_rad",), "per_joint"),
        *free_parameters(model, 1, ("anterior",), "per_joint"),
    )
    bounds = np.array([REACH, np.inf])
    cases = (MeasuredCase(LoadCase("push", 1, steps), measured),)
    evaluator = Evaluator(Problem(model, cases, free, np.ones(6), -bounds, bounds))
    sd = np.full(6, NOISE_RAD)
    unknowns = Lever(-bounds[:1], bounds[:1])
    return Target(evaluator, unknowns, noise_of(evaluator, sd, 0.0)), 60.0


def expected(theta: Array) -> dict[str, float]:
    """Mean and SD of ln k and of the offset, and the evidence, on a grid of the closed form."""
    x = np.linspace(-REACH, REACH, 1201)
    offset = np.linspace(-5.0, 5.0, 801)
    grid, o = np.meshgrid(x, offset, indexing="ij")
    turned = -FORCES_N[:, None, None] * (ARM_M - SD_M * o) / (60.0 * np.exp(grid))
    like = norm.logpdf(DEG_PER_RAD * (turned - theta[:, None, None]), scale=DEG_PER_RAD * NOISE_RAD)
    density = np.exp(like.sum(axis=0)) * norm.pdf(o) / (2 * REACH)
    cell = (x[1] - x[0]) * (offset[1] - offset[0])
    total = density.sum() * cell
    means = [float((density * one).sum() * cell / total) for one in (grid, o)]
    sds = [
        float(np.sqrt((density * (one - mean) ** 2).sum() * cell / total))
        for one, mean in zip((grid, o), means, strict=True)
    ]
    return {"x": means[0], "x_sd": sds[0], "o": means[1], "o_sd": sds[1], "log": np.log(total)}


def measured(k: float, offset: float) -> Array:
    rng = np.random.default_rng(5)
    return -FORCES_N * (ARM_M - SD_M * offset) / k + 0.3 * NOISE_RAD * rng.normal(size=3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "number"),
    [
        (15.0, 100),
        pytest.param(15.0, 800, marks=pytest.mark.full),
        pytest.param(400.0, 800, marks=pytest.mark.full),
    ],
)
def test_draws_are_those_of_the_closed_form(k: float, number: int) -> None:
    """A soft spring is known but for its arm; of a stiff one only that it is not soft."""
    theta = measured(k, 0.7)
    target, _ = lever(theta)
    mode = modes(target, np.array([[normal_of(-REACH, REACH, np.log(k / 60.0)), 0.0]]))[0]
    assert mode.point is not None
    chains = sample(target, mode, chains=2, warm_up=50, draws=number, seed=1)
    found, known = chains.z, expected(theta)
    x, _ = between(np.array([-REACH]), np.array([REACH]), found[..., :1])
    checked = convergence([found[..., 0], found[..., 1]])
    assert checked.r_hat.max() < 1.05  # chains this short are for moments, not to be believed
    # an average of n effective draws is off by sd / sqrt(n); five of these, as four are looked at
    for draws, ess, name in ((x[..., 0], 0, "x"), (found[..., 1], 1, "o")):
        slack = 5.0 / np.sqrt(min(checked.ess_bulk[ess], checked.ess_tail[ess]))
        assert abs(draws.mean() - known[name]) < slack * known[f"{name}_sd"]
        assert abs(draws.std() / known[f"{name}_sd"] - 1.0) < slack
    # Laplace, of a density that is skewed: a tenth of the evidence
    assert abs(mode.log_evidence - known["log"]) < 0.15


def test_gradient_and_curvature_are_those_of_the_energy() -> None:
    target, _ = lever(measured(30.0, 0.0))
    z, step = np.array([-0.4, 0.8]), 1e-4
    point = target.at(z)
    assert point is not None
    ends = [[target.at(z + side * step * one) for side in (1, -1)] for one in np.eye(2)]
    energies = np.array([[one.energy for one in pair if one] for pair in ends])
    slopes = (energies[:, 0] - energies[:, 1]) / (2 * step)
    np.testing.assert_allclose(point.gradient, slopes, rtol=1e-6)


def test_without_readings_that_tell_the_posterior_is_the_prior() -> None:
    """Noise a thousand times the motion: both unknowns stay standard normal."""
    target, _ = lever(measured(60.0, 0.0))
    loud = noise_of(target.evaluator, np.full(6, 1e3 * NOISE_RAD), 0.0)
    target = Target(target.evaluator, target.unknowns, loud)
    mode = modes(target, np.zeros((1, 2)))[0]
    np.testing.assert_allclose(mode.covariance, np.eye(2), atol=1e-3)
    z = sample(target, mode, chains=2, warm_up=30, draws=100, seed=3).z.reshape(-1, 2)
    assert np.abs(z.mean(axis=0)).max() < 0.25
    assert np.abs(z.std(axis=0) - 1.0).max() < 0.2


def test_many_searches_end_where_each_does_alone() -> None:
    theta = measured(20.0, 0.0)
    starts = np.array([[-0.5, 0.0], [0.5, 1.0], [0.0, -1.0]])
    together = modes(lever(theta)[0], starts)
    alone = [modes(lever(theta)[0], start[None])[0] for start in starts]
    for one, other in zip(together, alone, strict=True):
        assert one.point is not None
        assert other.point is not None
        np.testing.assert_allclose(one.point.z, other.point.z, atol=1e-2)
        assert one.log_evidence == pytest.approx(other.log_evidence, abs=1e-3)


def test_the_same_seed_gives_the_same_draws() -> None:
    def drawn() -> Array:
        target, _ = lever(measured(20.0, 0.0))
        mode = modes(target, np.zeros((1, 2)))[0]
        return sample(target, mode, chains=2, warm_up=20, draws=20, seed=9).z

    assert np.array_equal(drawn(), drawn())


def test_chains_that_stay_apart_are_not_believed() -> None:
    rng = np.random.default_rng(0)
    together = rng.normal(size=(4, 1000))
    apart = together + np.array([[0.0], [0.0], [0.0], [0.5]])
    slow = np.cumsum(rng.normal(size=(4, 1000)), axis=1)
    assert convergence([together]).message == ""
    assert "R-hat" in convergence([together, apart]).message
    assert "effective size" in convergence([slow]).message


def test_effective_size_of_an_autoregressive_chain() -> None:
    """An AR(1) chain of coefficient a has n (1 - a) / (1 + a) effective draws."""
    rng, a, n = np.random.default_rng(2), 0.6, 20_000
    chains = np.zeros((4, n))
    for step in range(1, n):
        chains[:, step] = a * chains[:, step - 1] + np.sqrt(1 - a * a) * rng.normal(size=4)
    found = convergence([chains])
    assert found.ess_bulk[0] == pytest.approx(4 * n * (1 - a) / (1 + a), rel=0.1)


@sweep("along", [-9.0, -3.9, 0.3, 3.9, 9.0])
def test_the_slope_of_a_density_in_other_coordinates_is_that_of_its_values(along: float) -> None:
    """Within the quantiles that are kept, and beyond them on both sides, where they go straight."""
    places = np.linspace(-OUTERMOST, OUTERMOST, 33)
    rising = PchipInterpolator(places, np.sinh(0.4 * places))
    chart = _Chart(np.array([0.2, 0.0]), np.array([[0.6, 0.3], [0.0, 1.0]]), {1: rising})

    def energy(y: Array) -> tuple[Array, float]:
        z = chart.z(y)
        nothing = np.zeros((2, 2))
        point = Point(z, z, 0.5 * float(z @ z), z, nothing, None)  # type: ignore[arg-type]
        return chart.density(y, point)

    y, step = np.array([0.7, along]), 1e-5
    slope = [energy(y + move)[1] - energy(y - move)[1] for move in step * np.eye(2)]
    np.testing.assert_allclose(energy(y)[0], np.array(slope) / (2.0 * step), rtol=1e-6, atol=1e-6)


def made_point(energy: float) -> Point:
    nothing = np.zeros((2, 2))
    return Point(np.zeros(2), np.zeros(2), energy, np.zeros(2), nothing, None)  # type: ignore[arg-type]


def test_the_evidence_of_a_mode_is_that_of_the_normal_with_its_curvature() -> None:
    curved = np.array([[4.0, 1.0], [1.0, 9.0]])
    mode = _mode(made_point(2.5), "", curved)
    np.testing.assert_allclose(mode.covariance, np.linalg.inv(curved), rtol=1e-12)
    np.testing.assert_allclose(mode.root @ mode.root.T, mode.covariance, rtol=1e-12)
    # exp(-2.5) times the integral of exp(-z'Cz/2), over (2 pi)^(m/2)
    assert mode.log_evidence == pytest.approx(-2.5 - 0.5 * np.log(np.linalg.det(curved)), rel=1e-12)


@pytest.mark.parametrize(
    ("point", "curved"),
    [
        (None, None),
        (made_point(0.0), None),
        (made_point(0.0), np.diag([1.0, -1.0])),
        (made_point(0.0), np.diag([1.0, 0.0])),
    ],
    ids=["nowhere", "beside an edge", "saddle", "flat"],
)
def test_what_is_no_mode_has_no_evidence_and_says_why(
    point: Point | None, curved: Array | None
) -> None:
    mode = _mode(point, "nowhere", curved)
    assert mode.point is None
    assert mode.log_evidence == -np.inf
    assert mode.message
