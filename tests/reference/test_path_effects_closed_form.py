"""Hysteresis and creep against their differential equations, solved by scipy for one joint.

Catches hysteresis or creep that is not its differential equation's.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import interp1d
from scipy.optimize import brentq
from scipy.stats import norm
from sweeps import sweep

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import System, follow
from spinepipe.world import Chain

SPRING = 40.0
TIGHT = {"rtol": 1e-10, "atol": 1e-12}
# s and N m: up, held, back beyond zero, held, up again
TIMES = np.array([0.0, 40.0, 140.0, 220.0, 300.0, 340.0])
MOMENTS = np.array([0.0, 4.0, 4.0, -3.0, -3.0, 2.0])


def joint(effect: str, *values: float, **options: str) -> SpineModel:
    """One joint on springs, without weight, with one more effect in extension."""
    springs = np.array([[1e5, 1e5, 1e5, SPRING, 50.0, 60.0]])
    return SpineModel(
        specimen="one joint",
        joints=("L4L5",),
        frames=(Pose(np.eye(3), np.zeros(3)),),
        bodies=(Body("L4", 0.5, np.array([0.0, 0.02, 0.0]), np.eye(3) * 1e-4),),
        gravity=np.zeros(3),
        damping=np.ones((1, 6)),
        effects=(
            ScopedEffect(create("linear_bushing"), (0,), springs),
            ScopedEffect(create(effect, options), (0,), np.array([values])),
        ),
    )


def extension(model: SpineModel, times: Array, moments: Array) -> Array:
    """(T,) rad."""
    nowhere = np.zeros(3)
    steps = tuple(
        LoadStep(i, (Wrench(0, nowhere, nowhere, np.array([0.0, 0.0, moment])),), float(time))
        for i, (time, moment) in enumerate(zip(times, moments, strict=True))
    )
    solved = follow(System(Chain(model), model, LoadCase("flexing", 1, steps)))
    return np.array([step.equilibrium.q[3] for step in solved])


def steps_of(per_piece: int) -> tuple[Array, Array]:
    """Times and moments with that many steps from each corner of the history to the next."""
    where = np.linspace(0.0, len(TIMES) - 1.0, (len(TIMES) - 1) * per_piece + 1)
    corners = np.arange(len(TIMES))
    return interp1d(corners, TIMES)(where), interp1d(corners, MOMENTS)(where)


@sweep("per_piece", [1, 10])
def test_friction_is_dahls_differential_equation(per_piece: int) -> None:
    """k dq + m dh = dM with dh = (1 - h sign dq) dq / y; how finely it is stepped is the same."""
    moment, yield_angle = 0.9, np.deg2rad(1.2)
    times, moments = steps_of(per_piece)

    def rate(time: float, state: Array, speed: float) -> list[float]:
        slope = (1.0 - state[1] * np.sign(speed)) / yield_angle
        turning = speed / (SPRING + moment * slope)
        return [turning, slope * turning]

    state, expected = np.zeros(2), [0.0]
    for piece in range(len(TIMES) - 1):
        start, end = TIMES[piece : piece + 2]
        speed = (MOMENTS[piece + 1] - MOMENTS[piece]) / (end - start)
        inside = times[(times > start + 1e-9) & (times < end + 1e-9)]
        run = solve_ivp(rate, (start, end), state, t_eval=inside, args=(speed,), **TIGHT)
        expected += list(run.y[0])
        state = run.y[:, -1]
    found = extension(joint("hysteresis", moment, yield_angle), times, moments)
    # the corner at the start of a step is rounded over 1e-4 yield angles
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4 * moment / SPRING)


@sweep("spread", [0.0, 0.7, 2.0])
@sweep("per_piece", [1, 7])
def test_friction_of_elements_is_springs_in_line_with_sliders(spread, per_piece) -> None:
    """Each h is cut at ±1, in 200 small moves of a step; corners here are rounded, there not."""
    moment, yield_angle = 0.9, np.deg2rad(0.6)
    places = norm.ppf((2.0 * np.arange(7) + 1.0) / 14.0)
    yields = yield_angle * np.exp(spread * places / np.sqrt(np.mean(places**2)))
    times, moments = steps_of(per_piece)

    def cut(h: Array, turned: float) -> Array:
        for _ in range(200):
            h = np.clip(h + turned / 200.0 / yields, -1.0, 1.0)
        return h

    q, h, expected = 0.0, np.zeros(7), [0.0]
    for load in moments[1:]:
        turned = brentq(
            lambda by, q=q, h=h, load=load: SPRING * (q + by) + moment * cut(h, by).mean() - load,
            *(-1.0, 1.0),
            xtol=1e-12,
        )
        q, h = q + turned, cut(h, turned)
        expected.append(q)
    found = extension(
        joint("hysteresis", moment, yield_angle, spread, law="jenkins"), times, moments
    )
    # each element falls short by 1.25 % of what it has left, at most
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.02 * moment / SPRING)


FRACTION, TIME = 0.4, 60.0


def retardation_times(spread: float) -> Array:
    """Five, evenly apart in their logarithm, whose SD is the spread."""
    return TIME / (1.0 - FRACTION) * np.exp(spread * np.arange(-2.0, 3.0) / np.sqrt(2.0))


def crept(times: Array, moments: Array, spread: float) -> Array:
    """Kelvin-Voigt elements in line with a spring k under a course of moments, by scipy.

    q = M / k + sum p, p_i' = (a M / k - p_i) / t_i; in the end 1 - f of the stiffness is left.
    """
    slow, lost = retardation_times(spread), FRACTION / (1.0 - FRACTION) / 5.0

    def rate(t: float, p: Array) -> Array:
        return (lost * np.interp(t, times, moments) / SPRING - p) / slow

    p, found = np.zeros(5), [0.0]
    for number in range(1, len(times)):
        run = solve_ivp(rate, times[number - 1 : number + 1], p, max_step=5.0, **TIGHT)
        p = run.y[:, -1]
        found.append(moments[number] / SPRING + p.sum())
    return np.array(found)


@sweep("spread", [0.0, 1.0, 2.5])
@sweep("per_piece", [1, 4])
def test_creep_under_ramps_is_kelvin_voigt_elements(spread: float, per_piece: int) -> None:
    times, moments = steps_of(per_piece)
    found = extension(joint("creep", FRACTION, TIME, spread, load="ramped"), times, moments)
    np.testing.assert_allclose(found, crept(times, moments, spread), rtol=0, atol=1e-9)


@sweep("spread", [0.0, 1.0, 2.5])
def test_creep_under_held_loads_adds_up_what_each_load_does(spread: float) -> None:
    """Boltzmann: each change of load drifts by its own clock."""
    slow, lost = retardation_times(spread), FRACTION / (1.0 - FRACTION)
    expected = [0.0]
    for end in range(1, len(TIMES)):
        steps = np.diff(MOMENTS[: end + 1])
        held = TIMES[end] - TIMES[:end]
        gone = 1.0 - np.exp(-held[:, None] / slow).mean(axis=1)
        expected.append(float(steps @ (1.0 + lost * gone)) / SPRING)
    found = extension(joint("creep", FRACTION, TIME, spread), TIMES, MOMENTS)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_creep_with_one_time_relaxes_at_constant_motion_in_that_time() -> None:
    """M falls from k q to (1 - f) k q as 1 - f (1 - exp(-t / time)): the standard linear solid."""
    effect, times = create("creep"), np.linspace(0.0, 150.0, 3001)
    q, carried = np.full((1, 6), 0.05), np.full((1, 6), SPRING * 0.05)
    values, state, found = np.array([[FRACTION, TIME, 0.0]]), np.zeros((1, 6)), []
    for seconds in np.diff(times, prepend=0.0):
        step = effect.advance(q, values, state, seconds, carried)
        found.append(step.state[0, -1])
        state = step.state
    expected = SPRING * 0.05 * (1.0 - FRACTION * -np.expm1(-times / TIME))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * SPRING * 0.05)


def test_wide_creep_is_logarithmic() -> None:
    """Within the spectrum, 2.3 decades wide and its middle at 100 s, each decade drifts alike."""
    times = np.array([0.0, 1e-9, 20.0, 63.0, 200.0, 630.0])
    moments = np.array([0.0, 4.0, 4.0, 4.0, 4.0, 4.0])
    found = extension(joint("creep", FRACTION, TIME, 2.5), times, moments)
    drifts = np.diff(found[2:])
    narrow = np.diff(extension(joint("creep", FRACTION, TIME, 0.0), times, moments)[2:])
    assert drifts.max() / drifts.min() < 1.1
    assert narrow.max() / narrow.min() > 2.5
