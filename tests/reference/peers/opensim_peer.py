"""The chain in OpenSim 4: model, static root-find, forward dynamics, files from elsewhere.

Every body frame lies on the ground frame in the neutral pose, so centres of mass, inertias and
load points are used as the chain states them.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import opensim
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .chain import Chain, Load
from .newton import root

Array = NDArray[np.float64]
Law = Literal["coordinate", "bushing"]
Integrator = Literal["cpodes", "rkm"]

opensim.Logger.setLevelString("Off")
opensim.Logger.removeFileSink()

COORDINATES = ("anterior", "superior", "right", "extension", "right_bending", "left_rotation")

BUSHING_AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Columns: a BushingForce frame's x, y, z in joint axes (z, x, y). BushingForce measures body-fixed
X-Y-Z angles, which in this frame are the joint's Z-X'-Y'' angles."""

BUSHING_ORDER = (2, 0, 1)

INTEGRATORS = {
    "cpodes": opensim.Manager.IntegratorMethod_CPodes,
    "rkm": opensim.Manager.IntegratorMethod_RungeKuttaMerson,
}

FINEST_CPODES = 1e-7
"""At 1e-8 CPodes never ends on these stiffness values, whatever its step limit."""

MOST_INTERNAL_STEPS = 10_000_000
"""CPodes' own limit of 500 only makes it write an error to stderr and go on."""


class OpenSimChain(NamedTuple):
    """An OpenSim model ready to be asked.

    Attributes
    ----------
    model, state : the model and a working state; asking a question overwrites the state.
    coordinates : names in the order every array q of this module has.
    slots : (n,) where each coordinate stands in the state's own Q and U vectors.
    ramp_time : s; loads grow linearly from 0 to full over this time, then stay.
    """

    model: opensim.Model
    state: opensim.State
    coordinates: tuple[str, ...]
    slots: NDArray[np.int_]
    ramp_time: float


def build(chain: Chain, law: Law = "coordinate", ramp_time: float = 0.0) -> OpenSimChain:
    """Build the chain: one CustomJoint per level, springs conjugate to its coordinates.

    ``law`` chooses between one SpringGeneralizedForce per coordinate and one BushingForce per
    level, which are two spellings of the same law. With ``ramp_time`` 0 loads are constant.
    """
    model = opensim.Model()
    model.setGravity(_vec3(chain.gravity))
    frames = [model.getGround()]
    for level in range(chain.n_joints):
        frames.append(_add_body(model, chain, level))
        _add_joint(model, chain, level, frames[level], frames[level + 1])
    model.finalizeConnections()
    for level in range(chain.n_joints):
        if law == "coordinate":
            _add_springs(model, chain, level)
        else:
            _add_bushing(model, chain, level, frames[level], frames[level + 1])
    for number, load in enumerate(chain.loads):
        _add_load(model, f"load_{number}", f"body_{load.body}", load, ramp_time)
    names = [f"{name}_{level}" for level in range(chain.n_joints) for name in COORDINATES]
    return _ready(model, names, ramp_time)


def load_osim(path: Path, loads: Sequence[tuple[str, Load]] = ()) -> OpenSimChain:
    """Read an .osim file; coordinates are in the file's order.

    ``loads`` are added to those of the file, as (body name, load): ``Load.body`` is ignored and the
    load's point is in ground with all coordinates zero.
    """
    model = opensim.Model(str(path))
    built = _ready(model, _coordinate_names(model), 0.0)
    _set_q(built, np.zeros(len(built.coordinates)))
    model.realizePosition(built.state)
    # all points before the first addition: adding a component takes the model's system away
    points = [
        model.getGround()
        .findStationLocationInAnotherFrame(
            built.state, _vec3(load.point), model.getBodySet().get(body)
        )
        .to_numpy()
        for body, load in loads
    ]
    for number, ((body, load), point) in enumerate(zip(loads, points, strict=True)):
        _add_load(model, f"added_load_{number}", body, replace(load, point=point), 0.0)
    return _ready(model, _coordinate_names(model), 0.0)


def set_stiffness(built: OpenSimChain, stiffness: Array) -> None:
    """Change the spring stiffness (J, 6) of a model built with the coordinate law, in place."""
    forces = built.model.updForceSet()
    for name, value in zip(built.coordinates, np.ravel(stiffness), strict=True):
        spring = opensim.SpringGeneralizedForce.safeDownCast(forces.get(f"spring_{name}"))
        spring.setStiffness(float(value))


def residual(built: OpenSimChain, q: Array, factor: float = 1.0) -> Array:
    """Generalised load (n,) missing for equilibrium at pose q, from inverse dynamics at rest.

    ``factor`` scales the loads of a model built with a ramp; otherwise it must be 1.
    """
    _set_q(built, q, time=factor * built.ramp_time)
    solver = opensim.InverseDynamicsSolver(built.model)
    return solver.solve(built.state).to_numpy()[built.slots]


def inverse_dynamics(built: OpenSimChain, q: Array, qd: Array, qdd: Array) -> Array:
    """Generalised load (n,) missing for a motion, all forces of the model included."""
    _set_q(built, q)
    built.state.setU(_vector(_scatter(built, qd)))
    solver = opensim.InverseDynamicsSolver(built.model)
    return solver.solve(built.state, _vector(_scatter(built, qdd))).to_numpy()[built.slots]


def mass_matrix(built: OpenSimChain, q: Array) -> Array:
    """Mass matrix (n, n) at pose q."""
    _set_q(built, q)
    built.model.realizePosition(built.state)
    matrix = opensim.Matrix()
    built.model.getMatterSubsystem().calcM(built.state, matrix)
    return matrix.to_numpy()[np.ix_(built.slots, built.slots)]


def point_position(built: OpenSimChain, q: Array, body: str, point: Array) -> Array:
    """Where a point given in the body's own frame is in pose q: (3,) m in ground."""
    _set_q(built, q)
    built.model.realizePosition(built.state)
    frame = built.model.getBodySet().get(body)
    return frame.findStationLocationInGround(built.state, _vec3(point)).to_numpy()


def equilibrium(chain: Chain, tol: float = 1e-12, law: Law = "coordinate") -> Array:
    """Static pose (J, 6) of the chain under its loads."""
    return equilibrium_of(build(chain, law=law, ramp_time=1.0), tol).reshape(-1, 6)


def equilibrium_of(built: OpenSimChain, tol: float = 1e-12, start: Array | None = None) -> Array:
    """Static pose (n,) of any built or loaded model, from ``start`` or from the neutral pose."""
    q = np.zeros(len(built.coordinates)) if start is None else np.ravel(start)
    return root(lambda q, factor: residual(built, q, factor), q, tol)


def equilibrium_of_file(
    path: Path, loads: Sequence[tuple[str, Load]] = (), tol: float = 1e-12
) -> dict[str, float]:
    """Coordinate name -> value (m, rad) of the static pose of an .osim file."""
    built = load_osim(path, loads)
    return dict(zip(built.coordinates, equilibrium_of(built, tol).tolist(), strict=True))


def settle(
    chain: Chain,
    duration: float,
    integrator: Integrator = "cpodes",
    times: Iterable[float] | None = None,
    accuracy: float = 1e-5,
    ramp_time: float = 0.0,
) -> Array:
    """Forward dynamics from rest in the neutral pose: (T, J, 6) at ``times``, or at the end only.

    ``accuracy`` is OpenSim's own setting; 1e-5 is what its forward tool takes when not told.
    """
    built = build(chain, ramp_time=ramp_time)
    return settle_of(built, duration, integrator, times, accuracy).reshape(-1, chain.n_joints, 6)


def settle_of(
    built: OpenSimChain,
    duration: float,
    integrator: Integrator = "cpodes",
    times: Iterable[float] | None = None,
    accuracy: float = 1e-5,
) -> Array:
    """As `settle`, on a model that is built already: (T, n).

    Raises
    ------
    ValueError : CPodes is asked for more than it can do; it would step on without end or message.
    RuntimeError : the integrator stopped early.
    """
    if integrator == "cpodes" and accuracy < FINEST_CPODES:
        raise ValueError(f"accuracy {accuracy:g}: CPodes takes {FINEST_CPODES:g} at the finest")
    _set_q(built, np.zeros(len(built.coordinates)))
    manager = opensim.Manager(built.model)
    manager.setIntegratorMethod(INTEGRATORS[integrator])
    manager.setIntegratorAccuracy(accuracy)
    manager.setIntegratorInternalStepLimit(MOST_INTERNAL_STEPS)
    manager.setWriteToStorage(False)
    manager.setPerformAnalyses(False)
    manager.initialize(built.state)
    poses = []
    for time in (duration,) if times is None else times:
        reached = manager.integrate(float(time))
        if not math.isclose(reached.getTime(), time):
            raise RuntimeError(f"stopped at {reached.getTime():g} s of {time:g} s")
        poses.append(reached.getQ().to_numpy()[built.slots])
    return np.array(poses)


def _add_body(model: opensim.Model, chain: Chain, level: int) -> opensim.Body:
    inertia = chain.inertias[level]
    moments, products = np.diag(inertia), inertia[[0, 0, 1], [1, 2, 2]]
    body = opensim.Body(
        f"body_{level}",
        float(chain.masses[level]),
        _vec3(chain.centres[level]),
        opensim.Inertia(*map(float, moments), *map(float, products)),
    )
    model.addBody(body)
    return body


def _add_joint(
    model: opensim.Model,
    chain: Chain,
    level: int,
    below: opensim.PhysicalFrame,
    body: opensim.Body,
) -> None:
    """The frame is the same on both sides, as both bodies lie on ground when neutral."""
    origin = _vec3(chain.origins[level])
    angles = _vec3(_xyz_angles(chain.rotations[level]))
    motion = _motion([f"{name}_{level}" for name in COORDINATES])
    model.addJoint(
        opensim.CustomJoint(f"joint_{level}", below, origin, angles, body, origin, angles, motion)
    )


def _motion(names: Sequence[str]) -> opensim.SpatialTransform:
    """Rotations about z, x', y'' and translations along x, y, z of the lower frame."""
    motion = opensim.SpatialTransform()
    axes = (
        (motion.upd_translation1(), (1.0, 0.0, 0.0)),
        (motion.upd_translation2(), (0.0, 1.0, 0.0)),
        (motion.upd_translation3(), (0.0, 0.0, 1.0)),
        (motion.upd_rotation1(), (0.0, 0.0, 1.0)),
        (motion.upd_rotation2(), (1.0, 0.0, 0.0)),
        (motion.upd_rotation3(), (0.0, 1.0, 0.0)),
    )
    for name, (axis, direction) in zip(names, axes, strict=True):
        axis.setCoordinateNames(opensim.ArrayStr(name, 1))
        axis.setAxis(opensim.Vec3(*direction))
        axis.set_function(opensim.LinearFunction(1.0, 0.0))
    return motion


def _add_springs(model: opensim.Model, chain: Chain, level: int) -> None:
    laws = zip(COORDINATES, chain.stiffness[level], chain.damping[level], strict=True)
    for name, stiffness, damping in laws:
        spring = opensim.SpringGeneralizedForce(f"{name}_{level}")
        spring.setName(f"spring_{name}_{level}")
        spring.setStiffness(float(stiffness))
        spring.setRestLength(0.0)
        spring.setViscosity(float(damping))
        model.addForce(spring)


def _add_bushing(
    model: opensim.Model,
    chain: Chain,
    level: int,
    below: opensim.PhysicalFrame,
    body: opensim.Body,
) -> None:
    axes = opensim.Rotation()
    axes.setRotationToBodyFixedXYZ(_vec3(_xyz_angles(chain.rotations[level] @ BUSHING_AXES)))
    frame = opensim.Transform(axes, _vec3(chain.origins[level]))
    (stiffness, damping) = (chain.stiffness[level], chain.damping[level])
    bushing = opensim.BushingForce(
        f"bushing_{level}",
        below,
        frame,
        body,
        frame,
        _vec3(stiffness[:3][list(BUSHING_ORDER)]),
        _vec3(stiffness[3:]),
        _vec3(damping[:3][list(BUSHING_ORDER)]),
        _vec3(damping[3:]),
    )
    model.addForce(bushing)


def _add_load(model: opensim.Model, name: str, body: str, load: Load, ramp_time: float) -> None:
    """``load.point`` is in the body's own frame here."""
    force = opensim.PrescribedForce(name, model.getBodySet().get(body))
    force.setForceIsInGlobalFrame(True)
    force.setPointIsInGlobalFrame(False)
    force.setForceFunctions(*(_load_function(value, ramp_time) for value in load.force))
    force.setTorqueFunctions(*(_load_function(value, ramp_time) for value in load.moment))
    force.setPointFunctions(*(opensim.Constant(float(value)) for value in load.point))
    model.addForce(force)


def _load_function(value: float, ramp_time: float) -> opensim.Function:
    """A PiecewiseLinearFunction goes on along its last piece, so the last piece is level."""
    if ramp_time == 0.0:
        return opensim.Constant(float(value))
    function = opensim.PiecewiseLinearFunction()
    for time, share in ((0.0, 0.0), (ramp_time, 1.0), (2 * ramp_time, 1.0)):
        function.addPoint(time, share * float(value))
    return function


def _ready(model: opensim.Model, names: Sequence[str], ramp_time: float) -> OpenSimChain:
    """Initialise the model and find where each coordinate stands in Q, by setting it alone."""
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    for name in names:
        coordinates.get(name).setValue(state, 0.0, False)
    slots = []
    for name in names:
        coordinates.get(name).setValue(state, 1.0, False)
        slots.append(int(np.argmax(np.abs(state.getQ().to_numpy()))))
        coordinates.get(name).setValue(state, 0.0, False)
    if sorted(slots) != list(range(len(slots))):
        raise ValueError("coordinates do not map one to one onto the state")
    return OpenSimChain(model, state, tuple(names), np.array(slots), ramp_time)


def _coordinate_names(model: opensim.Model) -> list[str]:
    coordinates = model.getCoordinateSet()
    return [coordinates.get(i).getName() for i in range(coordinates.getSize())]


def _set_q(built: OpenSimChain, q: Array, time: float = 0.0) -> None:
    """Put the working state at rest in pose q. A ramp time of 0 means loads ignore the time."""
    built.state.setTime(time)
    built.state.setQ(_vector(_scatter(built, q)))
    built.state.setU(opensim.Vector(len(built.slots), 0.0))


def _scatter(built: OpenSimChain, values: Array) -> Array:
    scattered = np.empty(len(built.slots))
    scattered[built.slots] = np.ravel(values)
    return scattered


def _xyz_angles(rotation: Array) -> Array:
    """Body-fixed X-Y-Z angles, the orientation OpenSim's frames are given in."""
    return Rotation.from_matrix(rotation).as_euler("XYZ")


def _vec3(values: Iterable[float]) -> opensim.Vec3:
    return opensim.Vec3(*map(float, values))


def _vector(values: Array) -> opensim.Vector:
    if not all(map(math.isfinite, values)):
        raise ValueError(f"not finite: {values}")
    return opensim.Vector.createFromMat(np.ascontiguousarray(values, dtype=float))
