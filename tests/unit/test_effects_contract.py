"""The contract of effects carries one example of each kind, alone and all together.

Catches an effect of any kind that the engine adds, scopes or differentiates wrongly.
"""

from dataclasses import replace

import numpy as np
import pytest
from effect_slopes import reported, reported_by_parameters, system_with, unknowns
from example_effects import (
    POINTS,
    CubicStiffening,
    ExtraWeight,
    FollowerLoad,
    JointCentreOffset,
    Laxity,
    MarkerError,
    PreloadStiffening,
    Relaxation,
    bushing,
    loaded,
    scoped,
    slope,
    spine,
)
from sweeps import sweep

from spinepipe.calibration import MeasuredCase, Problem, fit
from spinepipe.effects import (
    EffectKind,
    GeometryEffect,
    JointLaw,
    LoadEffect,
    MeasurementBeside,
    MeasurementEffect,
    PathLaw,
    create,
    register,
    registered,
    registry,
)
from spinepipe.effects.contract import Array
from spinepipe.model import SpineModel
from spinepipe.statics import (
    FreeParameter,
    System,
    declared,
    follow,
    free_parameters,
)
from spinepipe.statics.joint_forces import States
from spinepipe.status import Status
from spinepipe.world import Chain

PROTOCOLS = {
    EffectKind.JOINT_LAW: JointLaw,
    EffectKind.LOAD: LoadEffect,
    EffectKind.GEOMETRY: GeometryEffect,
    EffectKind.PATH: PathLaw,
    EffectKind.MEASUREMENT: MeasurementEffect,
}

ALONE = {
    "joint law": (scoped(CubicStiffening(), (0, 2)),),
    "law on carried load": (scoped(Laxity(), (1,)),),
    "law on compression": (scoped(PreloadStiffening(), (0, 1, 2)),),
    "load": (scoped(ExtraWeight(POINTS), (0, 1, 2)),),
    "load that turns": (scoped(FollowerLoad(2, POINTS[2]), (0, 1, 2)),),
    "geometry": (scoped(JointCentreOffset(), (0, 2), (0.008, -0.006), (-0.01, 0.004)),),
    "path": (scoped(Relaxation(), (1, 2)),),
    "measurement": (scoped(MarkerError(), (0, 2), (1.1, 0.02)),),
}

TOGETHER = (
    *ALONE["joint law"],
    *ALONE["path"],
    *ALONE["law on carried load"],
    *ALONE["law on compression"],
    scoped(Laxity(), (0, 1, 2), (0.1,)),  # reads what the path law carries
    *ALONE["geometry"],
    scoped(JointCentreOffset(), (2,), (0.003, 0.005)),  # on top of the other one
    *ALONE["load"],
    *ALONE["load that turns"],
    *ALONE["measurement"],
    scoped(MarkerError(), (0, 1, 2), (0.95, -0.01)),
)

CASES = [
    *(pytest.param(effects, id=name) for name, effects in ALONE.items()),
    pytest.param(TOGETHER, id="all together"),
    *(
        pytest.param((effect,), id=f"one row for all joints: {effect.effect.kind}")
        for effect in (
            scoped(CubicStiffening(per_joint=False), (0, 1, 2)),
            scoped(JointCentreOffset(False), (0, 1, 2), (0.008, -0.006)),
            scoped(MarkerError(per_joint=False), (0, 1, 2), (1.1, 0.02)),
        )
    ),
]


@sweep("effects", CASES)
def test_examples_satisfy_exactly_their_own_protocol(effects) -> None:
    for scope in effects:
        kinds = [kind for kind, protocol in PROTOCOLS.items() if isinstance(scope.effect, protocol)]
        assert kinds == [scope.effect.kind]


@sweep("effects", CASES)
def test_tangent_is_the_slope_of_the_residual(effects) -> None:
    system, rng = system_with(*effects), np.random.default_rng(1)
    q = np.tile([1e-3] * 3 + [0.15] * 3, 3) * rng.normal(size=18)
    empty = system.initial_states().of
    states = States({index: rng.normal(0, 0.05, s.shape) for index, s in empty.items()})
    loading = system.slots.loading(system.case.steps[1].wrenches)
    tangent = system.balance(q, loading, states).tangent
    for column, size in enumerate(np.tile([1e-4] * 3 + [1e-3] * 3, 3)):
        direction = np.eye(18)[column]

        def residual(h: float, along: Array = direction) -> Array:
            return system.balance(q + h * along, loading, states).residual

        # fourth-order differences: 1e-12 of loads up to 1e3, over a step of 1e-4 m or 1e-3 rad
        expected = slope(residual, size)
        np.testing.assert_allclose(tangent[:, column], expected, rtol=1e-7, atol=1e-4)


@sweep("effects", CASES)
def test_parameter_sensitivities_are_slopes_of_solved_motion(effects) -> None:
    system = system_with(*effects)
    free = unknowns(system.model)
    found = reported_by_parameters(system, free)
    for direction in directions(system.model, free):

        def motion(h: float, along: Array = direction) -> Array:
            return reported(system, free, h * along)

        expected = slope(motion, 0.1)
        # poses are solved to 1e-13 rad; what is left is the difference's own error
        scale = np.abs(expected).max()
        assert scale > 0.0
        np.testing.assert_allclose(found @ direction, expected, rtol=0, atol=1e-6 * scale)


def directions(model: SpineModel, free: tuple[FreeParameter, ...]) -> Array:
    """(D, m) each unknown by itself when they are few, else three mixtures of all."""
    scale = [declared(model, unknown).prior_scale for unknown in free]
    sizes = np.where([unknown.logarithmic for unknown in free], 0.2, scale)
    if len(free) <= 6:
        return np.diag(sizes)
    return np.random.default_rng(2).choice([-0.5, 0.5], (3, len(free))) * sizes


def test_effects_change_the_motion_they_are_meant_to_change() -> None:
    plain = reported(system_with())
    for name, effects in ALONE.items():
        change = np.abs(reported(system_with(*effects)) - plain)
        assert change[..., 3].max() > np.deg2rad(0.02), name


def test_path_state_of_a_step_comes_from_the_steps_before() -> None:
    steps = follow(system_with(*ALONE["path"]))
    first, second = steps[0], steps[1]
    assert not first.states.of[1].any()
    angle = first.equilibrium.q.reshape(-1, 6)[[1, 2], 3]
    np.testing.assert_allclose(second.states.of[1][:, 0], (1 - np.exp(-2 / 3)) * angle, rtol=1e-14)


def test_geometry_without_offset_leaves_the_motion_alone() -> None:
    still = scoped(JointCentreOffset(), (0, 1, 2), (0.0, 0.0))
    plain, found = (reported(system_with(*e)) for e in ((), (still,)))
    np.testing.assert_allclose(found, plain, rtol=0, atol=1e-13)


def test_laws_about_a_displaced_centre_are_a_joint_frame_displaced_alike() -> None:
    """The same physics said twice: springs about c, or the joint frame moved to c."""
    offset = np.array([0.008, -0.006, 0.0])
    model = spine(3, effects=(scoped(JointCentreOffset(), (0, 1, 2), (0.008, -0.006)),))
    frames = tuple(replace(f, origin=f.origin + f.rotation @ offset) for f in model.frames)
    other = replace(spine(3), frames=frames)
    case = loaded(model)
    solved = [follow(System(Chain(m), m, case)) for m in (model, other)]
    for about, moved_frame in zip(*solved, strict=True):
        system = System(Chain(model), model, case)
        placed = system.joint_kinematics(about.equilibrium.q, by_parameters=False).q
        expected = moved_frame.equilibrium.q.reshape(-1, 6)
        np.testing.assert_allclose(placed, expected, rtol=0, atol=1e-12)


def test_effects_out_of_a_tests_scope_do_nothing() -> None:
    away = tuple(replace(scope, tests=("another",)) for scope in TOGETHER)
    system = system_with(*away)
    np.testing.assert_array_equal(reported(system), reported(system_with()))
    assert not reported_by_parameters(system, unknowns(system.model)).any()


MOVED = {
    "joint law": 0.5,
    "law on carried load": 0.1,
    "law on compression": 0.05,
    "load": 0.4,
    "load that turns": 15.0,
    "geometry": 0.004,
    "path": 0.4,
    "measurement": 0.05,
}


@sweep("name", MOVED)
def test_calibration_finds_an_effects_parameters_back(name: str) -> None:
    model = spine(3, effects=ALONE[name])
    free = free_parameters(
        model, 1, [p.name for p in model.effects[1].effect.parameters], "per_specimen"
    )
    free = (*free, *free_parameters(model, 0, ["extension_nm_per_rad"], "per_specimen"))
    truth = MOVED[name] * np.array([1.0, -0.8][: len(free) - 1])
    truth = np.append(truth, 0.3)
    case = loaded(model)
    measured = reported(System(Chain(model), model, case), free, truth)
    lower, upper = np.full((2, len(free)), [[-1.0], [1.0]])
    for column, unknown in enumerate(free):
        if not unknown.logarithmic:
            here = model.effects[unknown.effect].values[list(unknown.rows), unknown.column]
            parameter = declared(model, unknown)
            lower[column], upper[column] = parameter.low - here.min(), parameter.high - here.max()
    found = fit(Problem(model, (MeasuredCase(case, measured),), free, np.ones(6), lower, upper))
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(found.x, truth, rtol=1e-6, atol=1e-9)


@pytest.fixture
def own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of the registry that forgets what a test enters."""
    monkeypatch.setattr(registry, "_CLASSES", dict(registry._CLASSES))


@pytest.mark.usefixtures("own_registry")
def test_a_registered_effect_can_be_made_by_name() -> None:
    register("cubic_for_a_test")(CubicStiffening)
    made = create("cubic_for_a_test", {"coordinate": "left_rotation"})
    assert made == CubicStiffening("left_rotation")
    assert registered()["cubic_for_a_test"] is CubicStiffening
    with pytest.raises(ValueError, match="twice"):
        register("cubic_for_a_test")(Laxity)
    with pytest.raises(TypeError):
        registered()["other"] = Laxity


def test_the_registry_says_what_it_knows() -> None:
    with pytest.raises(ValueError, match=r"unknown effect 'bushing'; known: .*linear_bushing"):
        create("bushing")
    with pytest.raises(ValueError, match="no option 'stiff'"):
        create("linear_bushing", {"stiff": 1})


def test_every_registered_effect_declares_itself_fully() -> None:
    for name, cls in registered().items():
        effect = cls()
        assert effect.name == name
        assert isinstance(effect, PROTOCOLS[effect.kind] | MeasurementBeside)
        for parameter in effect.parameters:
            assert parameter.low <= parameter.default <= parameter.high
            assert parameter.prior_scale > 0.0
            assert parameter.meaning
            assert not parameter.logarithmic or parameter.low > 0.0


def test_a_linear_bushing_is_six_springs() -> None:
    q, scope = np.arange(12.0).reshape(2, 6), bushing(2)
    response = scope.effect.respond(q, scope.values, np.zeros((2, 6)))
    np.testing.assert_array_equal(response.load, scope.values * q)
    np.testing.assert_array_equal(np.einsum("jab,jb->ja", response.tangent, q), response.load)
    by_parameter = scope.effect.by_parameter(q, scope.values, np.zeros((2, 6)))
    np.testing.assert_array_equal(
        np.einsum("jab,jb->ja", by_parameter, scope.values), response.load
    )
