"""Hysteresis and creep against their differential equations, solved by scipy for one joint."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import interp1d

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


@pytest.mark.parametrize("per_piece", [1, 10])
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


FRACTION, TIME = 0.4, 60.0


def angle(moment: float, dashpot: float) -> float:
    """A spring (1 - f) k beside a Maxwell arm: spring f k on a dashpot of viscosity f k T.

    Its internal variable is the dashpot's angle: M = (1 - f) k q + f k (q - p), p' = (q - p) / T.
    """
    return (moment + FRACTION * SPRING * dashpot) / SPRING


def test_creep_under_held_loads_is_the_standard_linear_solid() -> None:
    dashpot, expected = np.zeros(1), [0.0]
    for number in range(1, len(TIMES)):
        moment = MOMENTS[number]
        run = solve_ivp(
            lambda t, p, moment=moment: (angle(moment, p) - p) / TIME,
            TIMES[number - 1 : number + 1],
            dashpot,
            **TIGHT,
        )
        dashpot = run.y[:, -1]
        expected.append(angle(moment, dashpot[0]))
    found = extension(joint("creep", FRACTION, TIME), TIMES, MOMENTS)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_creep_under_ramps_is_the_standard_linear_solid() -> None:
    def rate(t: float, dashpot: Array) -> Array:
        return (angle(np.interp(t, TIMES, MOMENTS), dashpot) - dashpot) / TIME

    errors = []
    for per_piece in (4, 8, 16):
        times, moments = steps_of(per_piece)
        run = solve_ivp(rate, (0.0, TIMES[-1]), [0.0], t_eval=times, max_step=5.0, **TIGHT)
        found = extension(joint("creep", FRACTION, TIME, load="ramped"), times, moments)
        errors.append(np.abs(found - angle(moments, run.y[0])).max())
    largest = 4.0 / SPRING
    assert errors[0] < 2e-3 * largest
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.2)
    assert errors[2] == pytest.approx(errors[1] / 4.0, rel=0.2)
