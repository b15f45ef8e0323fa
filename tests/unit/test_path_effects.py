"""Hysteresis and creep: closed forms of one joint, derivatives along a path, corners passed.

Catches hysteresis or creep that is no closed form's, and derivatives lost along the path.
"""

from dataclasses import replace
from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from example_effects import (
    POINTS,
    CubicStiffening,
    FollowerLoad,
    JointCentreOffset,
    Laxity,
    Relaxation,
    loaded,
    scoped,
    slope,
    spine,
)
from path_effect_cases import (
    EXTENSION_SPRING,
    angles,
    branches,
    creeping,
    friction,
    one_joint,
    turning,
)
from scipy.integrate import simpson
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.statics import (
    FreeParameter,
    System,
    by_parameters,
    declared,
    follow,
    free_parameters,
    with_parameters,
)
from spinepipe.world import Chain

EVERYWHERE = (0, 1, 2)
MIXED = (
    scoped(CubicStiffening(), EVERYWHERE),
    friction(3),
    scoped(Relaxation(), (1, 2)),
    creeping(3, spread=0.3),
    creeping(3, 0.2, 1.0, "left_rotation", spread=0.3),
    scoped(Laxity(), EVERYWHERE, (0.1,)),
    creeping(2, 0.15, 5.0, spread=0.3),  # carried by all before it, other creep included
    scoped(JointCentreOffset(), (0, 2), (0.008, -0.006), (-0.01, 0.004)),
    scoped(FollowerLoad(2, POINTS[2]), EVERYWHERE),
)
PATHS = {
    "hysteresis": (friction(3),),
    "friction of elements": (friction(3, 0.5, 1.0, spread=0.7),),
    "friction of shear": (friction(3, 20.0, 0.005, "anterior"),),
    "creep": (creeping(3, spread=0.3),),
    "creep of ramps": (creeping(3, load="ramped", spread=0.3),),
    "creep over decades": (creeping(3, spread=1.5),),
    "creep of ramps over decades": (creeping(3, load="ramped", spread=1.5),),
    "creep of what hysteresis carries": (
        friction(3, coordinate="right_bending"),
        creeping(3, coordinate="right_bending", spread=0.3),
    ),
    "mixed": MIXED,
}
OFF = {
    "hysteresis": (friction(3, 0.0),),
    "friction of elements": (friction(3, 0.0, 0.3, spread=0.7),),
    "creep": (creeping(3, 0.0),),
    "creep of ramps": (creeping(3, 0.0, load="ramped"),),
}


def unknowns(system: System, strengths_only: bool = False) -> tuple[FreeParameter, ...]:
    """All parameters of all effects but the springs', joint by joint."""
    return tuple(
        unknown
        for number, here in enumerate(system.model.effects)
        if number
        for unknown in free_parameters(
            system.model,
            number,
            [p.name for p in here.effect.parameters if p.off is not None or not strengths_only],
            "per_joint",
        )
    )


def poses(system: System, free: tuple[FreeParameter, ...], x: Array) -> Array:
    """(T, n) solved afresh with the unknowns moved by x."""
    solved = follow(system.with_model(with_parameters(system.model, free, x)))
    assert all(step.usable for step in solved)
    return np.stack([step.equilibrium.q for step in solved])


def system_of(effects, steps: int = 6) -> System:
    """Three tilted joints under gravity; loads grow, fall and turn back, 2 s a step."""
    model = spine(3, effects=effects)
    return System(Chain(model), model, loaded(model, steps))


@sweep("name", PATHS)
def test_sensitivities_along_a_path_are_slopes_of_solved_motion(name: str) -> None:
    system, step = system_of(PATHS[name]), 1e-3 if name == "friction of elements" else 0.02
    free = unknowns(system)
    found = np.stack(by_parameters(system, follow(system), free))
    sizes = np.array(
        [0.2 if u.logarithmic else 0.3 * declared(system.model, u).prior_scale for u in free]
    )
    for mixture in np.random.default_rng(3).choice([-1.0, 1.0], (1, len(free))) * sizes:

        def motion(h: float, along: Array = mixture) -> Array:
            return poses(system, free, h * along)

        expected = slope(motion, step)
        scale = np.abs(expected).max()
        # fourth-order differences across laws whose curvature jumps: of elements, at each corner
        np.testing.assert_allclose(found @ mixture, expected, rtol=0, atol=1e-6 * scale)


@sweep("effects", OFF.values())
def test_a_strength_that_is_off_shows_how_it_would_act(effects) -> None:
    plain = np.stack([step.equilibrium.q for step in follow(system_of(()))])
    system = system_of(effects)
    free = unknowns(system, strengths_only=True)
    solved = follow(system)
    found = np.stack(by_parameters(system, solved, free))
    still = np.stack([step.equilibrium.q for step in solved])
    np.testing.assert_allclose(still, plain, rtol=0, atol=1e-13)
    assert np.abs(found).max(axis=(0, 1)).all()
    for along in np.random.default_rng(3).uniform(0.3, 1.0, (1, len(free))):
        at = [poses(system, free, h * along) for h in 0.004 * np.arange(5)]
        expected = np.tensordot([-25.0, 48.0, -36.0, 16.0, -3.0], at, 1) / (12.0 * 0.004)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found @ along, expected, rtol=0, atol=1e-5 * scale)


def test_parameters_of_shape_say_nothing_while_the_strength_is_off() -> None:
    system = system_of((*OFF["hysteresis"], *OFF["creep"]))
    shapes = [u for u in unknowns(system) if declared(system.model, u).off is None]
    assert len(shapes) == 9
    for by_x in by_parameters(system, follow(system), shapes):
        assert not by_x.any()


def test_a_step_without_a_change_of_load_changes_neither_pose_nor_derivative() -> None:
    model = spine(3, effects=(friction(3, 1.0),))
    system = System(Chain(model), model, turning(model, [2.0, 2.0, 1.0, 1.0, 1.0]))
    free = unknowns(system)
    cold = follow(system)
    warm = follow(system, [step.equilibrium.q + 1e-3 for step in cold])
    for solved in (cold, warm):
        dq = by_parameters(system, solved, free)
        for step, held in ((0, 1), (2, 3), (3, 4)):
            np.testing.assert_allclose(
                solved[held].equilibrium.q, solved[step].equilibrium.q, rtol=0, atol=1e-11
            )
            # the tangent is that of Newton's last but one pose: 1e-9 rad of 1e-4 yield angles
            scale = np.abs(dq[step]).max()
            np.testing.assert_allclose(dq[held], dq[step], rtol=0, atol=1e-3 * scale)


def test_a_cycle_of_friction_takes_the_work_of_the_closed_form() -> None:
    """Between -A and A the steady branches start from h = -+tanh(A / y): area 4 m (A - y tanh)."""
    moment, yield_deg, largest = 0.8, 1.5, np.deg2rad(3.0)
    y = np.deg2rad(yield_deg)
    up = largest * np.linspace(-1.0, 1.0, 41)
    start = np.tanh(largest / y)
    rising = 1.0 - (1.0 + start) * np.exp(-(up + largest) / y)
    # three rounds between the same two moments forget how the first one began: exp(-12)
    there = np.array([EXTENSION_SPRING * largest + moment * start])
    rounds = np.concatenate([there, -there] * 3)
    one_way = EXTENSION_SPRING * up + moment * rising
    model = one_joint(friction(1, moment, yield_deg))
    found = angles(model, np.concatenate([rounds, one_way[1:], -one_way[1:]]))
    q = found[5:]
    # rounding of the corner: a share of 1e-4 yield angles in steps of 0.1
    np.testing.assert_allclose(q, [*up, *-up[1:]], rtol=0, atol=1e-3 * moment / EXTENSION_SPRING)
    loads = np.concatenate([one_way, -one_way[1:]])
    work = simpson(loads[:41], x=q[:41]) + simpson(loads[40:], x=q[40:])
    assert work == pytest.approx(4.0 * moment * (largest - y * start), rel=1e-3)


@pytest.mark.parametrize("gravity", [False, True])
def test_six_joints_go_through_loading_unloading_and_loading_again(gravity: bool) -> None:
    effects = tuple(friction(6, coordinate=c) for c in ("extension", "right_bending"))
    model = spine(6, gravity, effects)
    solved = follow(System(Chain(model), model, turning(model, branches(7.5, 20))))
    assert all(step.usable for step in solved)
    assert max(step.equilibrium.iterations for step in solved) <= 8
    q = np.stack([step.equilibrium.q.reshape(-1, 6)[:, 3] for step in solved])
    loading, unloading, reloading = q[10], q[30], q[90]
    # at 3.75 N m friction has changed sides: 0.5 N m each way on springs of 41 or 36 N m/rad
    assert (unloading - loading > 0.5 * 2 * 0.5 / 41.0).all()
    assert (unloading - reloading > 0.8 * 2 * 0.5 / 41.0).all()


@pytest.mark.parametrize(
    ("moment", "yield_deg", "steps"), [(0.5, 0.05, 3), (2.0, 0.1, 1), (5.0, 1.0, 3)]
)
def test_corners_much_sharper_than_a_step_are_passed(moment, yield_deg, steps) -> None:
    coordinates = ("extension", "right_bending", "left_rotation")
    effects = tuple(friction(6, moment, yield_deg, c) for c in coordinates)
    model = spine(6, effects=effects)
    direction = np.array([0.3, 0.4, 0.85])
    system = System(Chain(model), model, turning(model, branches(7.5, steps), direction))
    for step in follow(system):
        assert step.usable
        left = system.residual(step.equilibrium.q, step.loading, step.states)
        assert np.abs(left).max() < 1e-6
        assert all(np.abs(after.state[:, 1]).max() < 1.01 for after in step.advances.values())


def drift(fraction: float, per_time: float, load: str) -> tuple[Array, Array]:
    """Found and exact extension while 2 N m are held for five time constants of 60 s.

    k q = M + f z and dz/dt = (k q - z) / T give
    q = M / k (1 + f / (1 - f) (1 - exp(-(1 - f) t / T))).
    """
    times = np.arange(0.0, 5.0 + 1e-9, per_time) * 60.0
    creep = creeping(1, fraction, 60.0, load=load)
    found = angles(one_joint(creep), np.full(len(times), 2.0), times)
    kept = 1.0 - fraction
    exact = 1.0 + fraction / kept * (1.0 - np.exp(-kept * times / 60.0))
    return found, 2.0 / EXTENSION_SPRING * exact


@sweep("load", ["held", "ramped"])
@sweep("fraction", [0.2, 0.5, 0.9])
def test_a_held_load_creeps_by_the_closed_form(fraction: float, load: str) -> None:
    """A ramp that stands still is a held load, in steps of any length."""
    for per_time in (0.05, 0.5, 2.5):
        found, exact = drift(fraction, per_time, load)
        np.testing.assert_allclose(found, exact, rtol=1e-11)


def test_one_long_step_ends_at_the_long_term_stiffness() -> None:
    found = angles(one_joint(creeping(1, 0.5, 1.0)), np.full(2, 2.0), np.array([0.0, 1e9]))
    assert found[1] == pytest.approx(2.0 / (0.5 * EXTENSION_SPRING), rel=1e-8)


def test_where_no_time_is_recorded_nothing_creeps() -> None:
    model = spine(3, effects=(creeping(3),))
    with_creep, without = (
        follow(System(Chain(m), m, turning(m, [2.0, 2.0, -1.0]))) for m in (model, spine(3))
    )
    for one, other in zip(with_creep, without, strict=True):
        np.testing.assert_allclose(one.equilibrium.q, other.equilibrium.q, rtol=0, atol=1e-13)


@pytest.mark.parametrize("effect", ["hysteresis", "creep"])
def test_each_cycle_starts_without_a_memory(effect: str) -> None:
    model = spine(3, effects=PATHS[effect])
    chain, once = Chain(model), loaded(model, 3)
    first = follow(System(chain, model, once))
    again = follow(System(chain, model, replace(once, cycle=2)))
    on = follow(System(chain, model, loaded(model, 6)))[3:]
    for one, other, later in zip(first, again, on, strict=True):
        np.testing.assert_array_equal(other.equilibrium.q, one.equilibrium.q)
        assert np.abs(later.equilibrium.q - one.equilibrium.q).max() > np.deg2rad(0.05)


SECONDS = sweep("seconds", [1e-7, 1e-3, 0.0299, 0.0301, 2.0, 300.0])


@SECONDS
@sweep("spread", [0.0, 1.2])
@sweep("load", ["held", "ramped"])
def test_creep_states_its_derivatives_at_any_length_of_step(load, spread, seconds) -> None:
    rng = np.random.default_rng(4)
    values = np.array([0.3, 3.0, spread])
    assert_slopes("creep", {"load": load}, values, rng.normal(size=6), seconds, 2.5)


@sweep("turned", [-3.0, -1e-3, -1e-5, 0.0, 1e-5, 1e-3, 0.4, 3.0])
@sweep("law", ["dahl", "jenkins"])
def test_friction_states_its_derivatives_at_any_length_of_step(law: str, turned: float) -> None:
    """Elements that have yielded, that have not, and steps far shorter than what is rounded."""
    yield_angle = 0.02
    held = np.array([1.0, -1.0, 0.3, -0.6, 0.0, 0.95, 0.999]) if law == "jenkins" else [0.3]
    values = np.array([0.7, yield_angle, 0.7][: 3 if law == "jenkins" else 2])
    state = np.array([0.01, *held])
    assert_slopes("hysteresis", {"law": law}, values, state, 1.0, 0.01 + turned * yield_angle)


def assert_slopes(name, options, values, state, seconds, at) -> None:
    """Load and next state by motion, carried load, parameters and state, by differences."""
    effect = create(name, options)
    column = 3

    def there(x: Array) -> tuple[Array, ...]:
        q, carried = np.zeros((2, 1, 6))
        q[0, column], carried[0, column] = x[0], x[1]
        split = 2 + len(values)
        return q, x[None, 2:split], x[None, split:], seconds, carried

    def outcome(x: Array) -> Array:
        load = effect.respond_on_path(*there(x)).load[0, column]
        return np.concatenate([[load], effect.advance(*there(x)).state[0]])

    start = np.concatenate([[at, at], values, state])
    step, parameter = effect.respond_on_path(*there(start)), effect.advance(*there(start))
    by_carried = np.zeros(6) if step.by_carried is None else step.by_carried[0, column]
    load = [
        [step.tangent[0, column, column], by_carried[column]],
        effect.by_parameter_on_path(*there(start))[0, column],
        effect.by_state(*there(start))[0, column],
    ]
    carried = np.zeros((len(state), 6)) if parameter.by_carried is None else parameter.by_carried[0]
    after = [
        parameter.by_coordinate[0, :, [column]].T,
        carried[:, [column]],
        parameter.by_parameter[0],
        parameter.by_state[0],
    ]
    found = np.vstack([np.concatenate(load), np.column_stack(after)])
    free = [k for k in range(len(start)) if not (name == "hysteresis" and at_an_end(start, k))]
    kept = np.ones(len(found), dtype=bool)
    if name == "hysteresis" and at == state[0]:  # what rounding adds beyond the end is not kept
        kept[2:] = np.abs(state[1:]) < 1.0
    for k in free:
        size = 1e-7 * max(abs(start[k]), 1e-2)
        expected = slope(lambda h, k=k, d=size: outcome(start + h * d * np.eye(len(start))[k]), 1.0)
        scale = np.abs(found[:, k]).max() + 1.0
        expected = expected[kept] / size
        np.testing.assert_allclose(found[kept, k], expected, rtol=0, atol=2e-6 * scale)


def at_an_end(start: Array, k: int) -> bool:
    """Whether it is the h of an element that has yielded: it does not go further."""
    return k > 4 and abs(start[k]) == 1.0


def test_elements_that_yield_together_are_a_spring_and_a_slider() -> None:
    """k q + m clip(q / y): without spread, between corners, on all branches; area 4 m (A - y)."""
    moment, y, largest = 0.8, np.deg2rad(0.7), np.deg2rad(3.0)
    there = EXTENSION_SPRING * largest + moment
    moments = np.array([there, -there, there, 0.5 * there, -there])
    found = angles(one_joint(friction(1, moment, 0.7, spread=0.0)), moments)
    # unloaded by half, the slider does not slip: its spring gives way with the joint's
    half = largest - 0.5 * there / (EXTENSION_SPRING + moment / y)
    assert (largest - half) / y < 2.0
    expected = [largest, -largest, largest, half, -largest]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * moment / EXTENSION_SPRING)


def test_friction_holds_a_translation() -> None:
    effect = create("hysteresis", {"coordinate": "anterior"})
    assert [p.name for p in effect.parameters] == ["force", "yield_distance"]
    q, state = np.zeros((1, 6)), np.zeros((1, 2))
    q[0, 0] = 3e-4
    values = np.array([[20.0, 2e-4]])
    load = effect.respond_on_path(q, values, state, 0.0, q).load
    np.testing.assert_allclose(load, [[20.0 * (1.0 - np.exp(-1.5)), 0, 0, 0, 0, 0]], rtol=1e-3)


def test_options_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="coordinate 'twist' is not one of anterior"):
        create("hysteresis", {"coordinate": "twist"})
    with pytest.raises(ValueError, match="law 'bouc' is not one of dahl, jenkins"):
        create("hysteresis", {"law": "bouc"})
    with pytest.raises(ValueError, match="coordinate 'twist' is not one of anterior"):
        create("creep", {"coordinate": "twist"})
    assert create("creep", {"coordinate": "superior"}).coordinate == "superior"


@sweep("x", [1e-9, 1e-6, 1e-3, 9.9e-3, 1.01e-2, 0.5])
def test_a_short_ramp_of_creep_moves_with_its_time_as_exact_sums_say(x: float) -> None:
    """With a carried load C that comes on over x relaxation times, one element holds
    M = C / (1 + l (1 - m)), m = sum of (-x)^k / (k + 1)!; x falls with the time as 1 / T."""
    f, time, load = 0.3, 40.0, 7.0
    exact, lost = Fraction(x), Fraction(f) / (1 - Fraction(f))
    terms = range(1, 30)
    mean = 1 + sum((-exact) ** k / factorial(k + 1) for k in terms)
    slope = sum(-k * (-exact) ** (k - 1) / Fraction(factorial(k + 1)) for k in terms)
    whole = Fraction(load) / (1 + lost * (1 - mean))
    by_time = -(whole**2) / Fraction(load) * lost * slope * exact / Fraction(time)
    effect = create("creep", {"load": "ramped"})
    q, carried = np.zeros((1, 6)), np.zeros((1, 6))
    carried[0, 3] = load
    start, values = np.zeros((1, effect.n_states)), np.array([[f, time, 0.0]])
    step = (q, values, start, x * time / (1.0 - f), carried)
    held = carried + effect.respond_on_path(*step).load
    assert held[0, 3] == pytest.approx(float(whole), rel=1e-14)
    found = effect.by_parameter_on_path(*step)[0, 3, 1]
    # terms that the series leaves out, and what differences of nearly equal numbers lose
    assert found == pytest.approx(float(by_time), rel=2e-12)
