"""Loops of load and rotation against closed forms, and their intervals against sampled noise.

Catches hysteresis, neutral zone or stiffness read off a loop wrongly, and intervals too short.
"""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate
from sweeps import sweep

from spinepipe.experiment.double_sigmoid import FEWEST_POINTS, Zone, fit_sigmoids, neutral_zone
from spinepipe.experiment.loop import (
    Loop,
    Measure,
    RotationErrors,
    reading_noise,
    stiffness_interval,
)

Array = NDArray[np.float64]

PEAK, SD = 7.5, float(np.deg2rad(0.1))
RISE, STEEP = float(np.deg2rad(16.0)), 0.9
"""One sigmoid: rad from end to end, and per N m."""


def ellipse(points: int, tilt: float = 0.03, width: float = 0.02) -> Loop:
    """Rotation runs behind the load: the loop is an ellipse, its area pi times peak times width."""
    phase = np.linspace(0.0, 2.0 * np.pi, points + 1)
    return Loop(PEAK * np.sin(phase), tilt * np.sin(phase) - width * np.cos(phase))


def up_and_down(points: int) -> Array:
    """Loads of a whole loop from zero: up, down to the other side, and back."""
    up = np.linspace(0.0, PEAK, points)
    return np.concatenate([up, np.linspace(PEAK, -PEAK, 2 * points - 1)[1:], -up[::-1][1:]])


def sigmoid(load: Array) -> Array:
    return RISE / (1.0 + np.exp(-STEEP * load)) - 0.5 * RISE


def uneven(load: Array) -> Array:
    """Two sigmoids: a soft middle on one side, and a slow rise."""
    first = np.deg2rad(6.0) / (1.0 + np.exp(-(0.5 + 1.2 * load)))
    return first + np.deg2rad(9.0) / (1.0 + np.exp(-(-0.3 + 0.35 * load)))


def test_the_area_of_an_ellipse() -> None:
    loop = ellipse(400)
    assert loop.closed
    assert loop.two_sided
    # a polygon in an ellipse has sin(h) / h of its area
    expected = np.pi * PEAK * 0.02 * np.sin(2.0 * np.pi / 400) / (2.0 * np.pi / 400)
    assert loop.area().value == pytest.approx(expected, rel=1e-9)
    turned = Loop(loop.load[::-1], loop.rotation[::-1])
    assert turned.area().value == pytest.approx(-expected, rel=1e-9), "a loop that gives energy"


def test_a_straight_loop_loses_nothing_and_has_no_neutral_zone() -> None:
    load = up_and_down(11)
    loop = Loop(load, 0.02 * load)
    assert abs(loop.area().value) < 1e-15
    assert loop.range_of_motion().value == pytest.approx(0.02 * 2.0 * PEAK)
    for places in loop.curves():
        zone, found, why = neutral_zone(load[places], loop.rotation[places], SD)
        assert zone is None
        assert found is Zone.NOT_MEANINGFUL
        assert "straight line" in why
    for side in (1, -1):
        slope = loop.elastic_compliance(side, None)
        assert slope is not None
        assert slope.value == pytest.approx(0.02)
        assert stiffness_interval(slope, 0.0) == pytest.approx((50.0, 50.0, 50.0))


@sweep(
    "loads, two_sided, unloaded, closed, curves",
    [
        ([0, 1, 2, 3], False, False, False, 0),
        ([0, 1, 2, 3, 2, 1, 0], False, True, True, 0),
        ([0, 2.5, 5, 7.5, -2.5, -5, -7.5], True, False, False, 1),
        ([0, 4, 8, 4, 0, -4, -8, -4, 0], True, True, True, 2),
        ([-8, -4, 0, 4, 8, 4, 0, -4, -8], True, True, True, 2),
        ([-8, -4, 0, 4, 8, 4], True, True, False, 1),
        ([0, 0, 0], False, False, False, 0),
    ],
)
def test_what_was_read_of_a_cycle(
    loads: list[float], two_sided: bool, unloaded: bool, closed: bool, curves: int
) -> None:
    loop = Loop(np.array(loads, dtype=float), np.array(loads) / 50.0)
    assert (loop.two_sided, loop.unloaded, loop.closed) == (two_sided, unloaded, closed)
    assert len(loop.curves()) == curves
    assert loop.goes_round_once
    assert not Loop(np.tile([0.0, 3.0, -3.0], 4), np.zeros(12)).goes_round_once


def test_branches_of_a_closed_loop_go_from_peak_to_peak() -> None:
    load = up_and_down(4)
    loop = Loop(load, load)
    for side, places in zip((1, -1), loop.curves(), strict=True):
        np.testing.assert_allclose(load[places][[0, -1]], [-side * PEAK, side * PEAK])
        assert (side * np.diff(load[places]) >= 0.0).all()
        loading = load[loop.loading(side)]
        np.testing.assert_allclose(loading, side * np.linspace(0.0, PEAK, 4)[1:])


def test_range_of_motion_from_the_first_reading_of_a_half_loop() -> None:
    """What is left at the end of the cycle is no range of motion."""
    half = Loop(np.array([0.0, -4.0, -8.0, -4.0, 0.0]), np.array([0.0, -1.0, -2.0, -1.5, -0.5]))
    assert half.range_of_motion().value == pytest.approx(2.0)
    assert half.area().value == pytest.approx(4.0 * (1.5 - 1.0) + 4.0 * 0.5 * 0.5)


@sweep("points", [11, 21, 41])
def test_the_neutral_zone_of_one_sigmoid_has_a_closed_form(points: int) -> None:
    """Smit et al. 2011 with one sigmoid: bends most at ln(2 + sqrt 3), rise over sqrt 3 wide."""
    load = np.linspace(-PEAK, PEAK, points)
    zone, found, _ = neutral_zone(load, sigmoid(load), SD)
    assert found is Zone.FOUND
    assert zone is not None
    end = np.log(2.0 + np.sqrt(3.0)) / STEEP
    # with eleven loads the steepest sigmoid that is allowed is a hundredth less steep
    close = 0.02 if points == 11 else 1e-6
    assert zone.ends == pytest.approx((-end, end), rel=close)
    assert zone.size.value == pytest.approx(RISE / np.sqrt(3.0), rel=close)
    assert 1.0 / zone.compliance.value == pytest.approx(2 * end * np.sqrt(3.0) / RISE, rel=close)


def test_the_neutral_zone_of_two_sigmoids_lies_where_differences_have_it() -> None:
    fine = np.linspace(-PEAK, PEAK, 150_001)
    second = np.gradient(np.gradient(uneven(fine), fine), fine)[5:-5]
    ends = fine[5:-5][[second.argmax(), second.argmin()]]
    load = np.linspace(-PEAK, PEAK, 31)
    zone, _, _ = neutral_zone(load, uneven(load), 1e-7)
    assert zone is not None
    np.testing.assert_allclose(zone.ends, ends, atol=2e-3)
    assert zone.size.value == pytest.approx(np.ptp(uneven(ends)), rel=1e-3)


def test_elastic_zones_begin_where_the_neutral_zone_ends() -> None:
    """A bilinear joint: soft to 2 N m, stiff beyond; an outlier does not move the slope."""
    load = np.linspace(-PEAK, PEAK, 31)
    bent = np.sign(load) * (
        np.minimum(np.abs(load), 2.0) / 20.0 + np.maximum(np.abs(load) - 2.0, 0.0) / 200.0
    )
    bent[-4] += 0.01
    slope = Loop(load, bent).elastic_compliance(1, 2.0)
    assert slope is not None
    value, low, high = stiffness_interval(slope, 1e-4)
    assert value == pytest.approx(200.0, rel=0.02)
    assert low is not None
    assert high is not None
    assert low < 200.0 < high
    wide = Measure(1e-3, np.zeros(3))
    assert stiffness_interval(wide, 2e-3) == (pytest.approx(1000.0), pytest.approx(1 / 3e-3), None)
    assert stiffness_interval(Measure(-1e-3, np.zeros(3)), 1e-4) == (None, None, None)
    assert Loop(load, bent).elastic_compliance(1, 7.4) is None, "one load is no line"


@sweep("zeroed", [False, True])
def test_propagated_intervals_are_those_of_sampled_noise(zeroed: bool) -> None:
    """1500 samples tell an SD to 2 %; that of the median slope is theory for many points."""
    rng = np.random.default_rng(1)
    round_trip, many = up_and_down(11), 1500
    straight = Loop(round_trip, 0.02 * round_trip)
    for loop, measured, close in (
        (ellipse(24), Loop.range_of_motion, 0.06),
        (ellipse(24), Loop.area, 0.06),
        (straight, lambda one: one.elastic_compliance(-1, None), 0.08),
    ):
        size = len(loop.load)
        noise = SD * rng.normal(size=(many, size))
        if zeroed:
            noise -= noise[:, :1]
        truth = measured(loop)
        found = np.array([measured(Loop(loop.load, loop.rotation + one)).value for one in noise])
        assert reading_noise([size], SD, zeroed).way(truth) == pytest.approx(
            1.96 * found.std(), rel=close
        )
        assert found.mean() == pytest.approx(truth.value, abs=4 * found.std() / np.sqrt(many))


def test_two_recordings_each_with_its_own_zero_are_noisier() -> None:
    """Peak less peak: two readings and two zeros."""
    one = Loop(np.array([0.0, 4.0, 8.0, 0.0, -4.0, -8.0]), np.arange(6.0))
    way = reading_noise([3, 3], SD, zeroed=True).way(one.range_of_motion())
    assert way == pytest.approx(1.96 * 2.0 * SD, rel=1e-3)
    known = np.array([True, True, True, False, True, True])
    assert reading_noise([3, 3], SD, zeroed=True).at(known).root.shape == (5, 6)


@pytest.mark.full
@sweep("curve, points", [(sigmoid, 21), (uneven, 31)])
def test_intervals_of_the_neutral_zone_hold_it(curve: object, points: int) -> None:
    """95 % asked for; at least 80 % held: to first order, and the number of sigmoids is chosen."""
    assert callable(curve)
    rng = np.random.default_rng(7)
    load, many = np.linspace(-PEAK, PEAK, points), 25
    exact, _, _ = neutral_zone(load, curve(load), 1e-7)
    assert exact is not None
    spread, held = reading_noise([points], SD, zeroed=False), 0
    for _ in range(many):
        zone, _, _ = neutral_zone(load, curve(load) + SD * rng.normal(size=points), SD)
        way = None if zone is None else spread.way(zone.size)
        if zone is not None and way is not None:
            held += abs(zone.size.value - exact.size.value) <= way
    assert held >= 0.8 * many


def test_noise_on_a_straight_line_is_no_neutral_zone() -> None:
    rng = np.random.default_rng(3)
    load = np.linspace(-PEAK, PEAK, 21)
    for sd in (SD, None):
        words = [
            neutral_zone(load, 0.02 * load + SD * rng.normal(size=21), sd)[1] for _ in range(12)
        ]
        assert words.count(Zone.FOUND) <= 2


def test_what_has_no_neutral_zone_says_why() -> None:
    few = np.linspace(-PEAK, PEAK, FEWEST_POINTS - 1)
    assert neutral_zone(few, sigmoid(few), SD)[1] is Zone.TOO_FEW
    assert neutral_zone(np.repeat(few, 3), sigmoid(np.repeat(few, 3)), SD)[1] is Zone.TOO_FEW
    load = np.linspace(-PEAK, PEAK, 21)
    for still in (np.zeros(21), -sigmoid(load)):
        assert "does not move with the load" in neutral_zone(load, still, SD)[2]
    inside_out = np.sinh(0.5 * load) / 100.0  # softest at the ends
    assert "no better than a straight line" in neutral_zone(load, inside_out, SD)[2]
    one_bend = np.log1p(np.exp(0.5 * load)) / 50.0  # stiff on one side, soft on the other
    assert "does not rise and fall" in neutral_zone(load, one_bend, SD)[2]
    curve = fit_sigmoids(load, sigmoid(load), SD)
    assert curve is not None
    np.testing.assert_allclose(curve.rotation(load), sigmoid(load), atol=1e-6)


def test_a_zone_narrower_than_the_steps_of_load_has_no_number() -> None:
    """Stiffness 0.3 of that outside within 2 deg: the compliance is a spike between two loads."""
    angle = np.deg2rad(np.linspace(-30.0, 30.0, 60_001))
    width = np.deg2rad(2.0)
    moment = 60.0 * angle - 42.0 * width * np.tanh(angle / width)
    load = np.linspace(-PEAK, PEAK, 11)
    zone, found, why = neutral_zone(load, np.interp(load, moment, angle), np.deg2rad(0.03))
    assert zone is None
    assert found is Zone.NOT_DESCRIBED
    assert "read more" in why


def test_what_nothing_is_known_of_leaves_no_interval() -> None:
    root, free = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    spread = RotationErrors(root, free, 2.0)
    assert spread.way(Measure(1.0, np.array([1.0, 0.0]))) == 2.0
    assert spread.way(Measure(1.0, np.array([1.0, 0.1]))) is None


def test_work_of_a_lagging_joint_is_the_integral_of_moment_over_rotation() -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 2001)
    load = PEAK * np.sin(phase)
    rotation = 0.1 * np.sin(phase - 0.3) + 0.02 * np.sin(phase - 0.3) ** 3
    work = integrate.simpson(load * np.gradient(rotation, phase), x=phase)
    assert Loop(load, rotation).area().value == pytest.approx(work, rel=1e-4)


def test_the_gap_at_zero_load_is_that_of_the_branches() -> None:
    """Up by 6 tanh((M - 0.5) / 3) deg, down half a N m earlier: 12 tanh(1 / 6) = 1.982 deg."""
    up = np.linspace(-7.3, 7.3, 27)  # no reading at zero
    load = np.concatenate([up[13:], up[-2::-1], up[1:14]])
    way = np.concatenate([np.full(14, -1.0), np.ones(26), np.full(13, -1.0)])
    turned = np.deg2rad(6.0) * np.tanh((load + 0.5 * way) / 3.0)
    gap = Loop(load, turned).gap()
    assert np.rad2deg(gap.value) == pytest.approx(12.0 * np.tanh(1.0 / 6.0), rel=2e-3)
    assert gap.weights @ turned == pytest.approx(gap.value)
    # where zero was read twice on the way up the later one counts: the first was never loaded
    load = np.concatenate([[0.0, 4.0, 7.0], [3.0, 0.0, -3.0, -7.0], [-4.0, 0.0]])
    turned = np.array([0.0, 4.0, 5.0, 4.0, 2.0, -1.0, -5.0, -4.0, -1.5])
    assert Loop(load, turned).gap().value == pytest.approx(3.5)
    assert Loop(load[:7], turned[:7]).gap() is None, "up once, and not from the other side"
    assert Loop(np.abs(load), turned).gap() is None


def test_a_threshold_of_stiffness_ends_the_zone_where_the_slope_is() -> None:
    """q = A tanh(M / w): dq/dM = A / w (1 - tanh2), so 1 - tanh2 = w / (A k) at the ends."""
    load = np.linspace(-7.5, 7.5, 31)
    a, w = np.deg2rad(6.0), 3.0
    for k in (40.0, 60.0):
        zone, found, _ = neutral_zone(load, a * np.tanh(load / w), 1e-6, below=k)
        assert found is Zone.FOUND
        end = np.sqrt(1.0 - w / (a * k))
        assert zone.size.value == pytest.approx(2.0 * a * end, rel=1e-3)
        assert zone.ends == pytest.approx((-w * np.arctanh(end), w * np.arctanh(end)), rel=1e-3)
        # its weights are its derivative: by differences, one reading after the other
        for place in (3, 15, 22):
            sizes = []
            for step in (1e-6, -1e-6):
                moved = a * np.tanh(load / w) + step * (np.arange(31) == place)
                sizes.append(neutral_zone(load, moved, 1e-4, below=k)[0].size.value)
            slope = (sizes[0] - sizes[1]) / 2e-6
            assert zone.size.weights[place] == pytest.approx(slope, abs=2e-2)
    for k in (20.0, 2000.0):  # stiffer everywhere, softer up to the ends
        assert neutral_zone(load, a * np.tanh(load / w), 1e-6, below=k)[1] is Zone.NOT_MEANINGFUL
