"""A trunk in OpenSim: eight bodies, seven joints, and each fascicle a path of points on bodies.

Every body's frame lies on the ground frame in the source's pose, so points are used as they stand.
A joint turns about z, then x, then y. Nothing wraps.
"""

from typing import NamedTuple

import numpy as np
import opensim
from numpy.typing import NDArray

from spinepipe.muscles.trunk import BODIES, LEVELS, NO_BODY, Trunk

Array = NDArray[np.float64]

opensim.Logger.setLevelString("Off")
opensim.Logger.removeFileSink()

AXES = (
    ("extension", (0.0, 0.0, 1.0)),
    ("right_bending", (1.0, 0.0, 0.0)),
    ("left_rotation", (0.0, 1.0, 0.0)),
)


class OpenSimTrunk(NamedTuple):
    """A model ready to be asked.

    Attributes
    ----------
    model, state : asking overwrites the state. names : of fascicles.
    """

    model: opensim.Model
    state: opensim.State
    names: tuple[str, ...]


def build(trunk: Trunk) -> OpenSimTrunk:
    """The trunk's bodies, joints and paths."""
    model = opensim.Model()
    nought, still = opensim.Vec3(0.0), opensim.Inertia(1.0, 1.0, 1.0)
    bodies = []
    for name in BODIES:
        bodies.append(opensim.Body(name, 1.0, nought, still))
        model.addBody(bodies[-1])
    model.addJoint(
        opensim.WeldJoint("base", model.getGround(), nought, nought, bodies[0], nought, nought)
    )
    for k, level in enumerate(LEVELS):
        at = opensim.Vec3(*trunk.joints[k])
        ends = (bodies[k], at, nought, bodies[k + 1], at, nought)
        model.addJoint(opensim.CustomJoint(level, *ends, _turning(level)))
    muscles = trunk.muscles
    for k, name in enumerate(muscles.names):
        path = opensim.PathActuator()
        path.setName(name)
        for number, body in enumerate(muscles.body[k]):
            if body != NO_BODY:
                at = opensim.Vec3(*muscles.point[k, number])
                path.addNewPathPoint(f"{name}_{number}", bodies[body], at)
        model.addForce(path)
    return OpenSimTrunk(model, model.initSystem(), muscles.names)


def _turning(level: str) -> opensim.SpatialTransform:
    motion = opensim.SpatialTransform()
    axes = (motion.upd_rotation1(), motion.upd_rotation2(), motion.upd_rotation3())
    for axis, (name, along) in zip(axes, AXES, strict=True):
        names = opensim.ArrayStr()
        names.append(f"{level}_{name}")
        axis.setCoordinateNames(names)
        axis.setAxis(opensim.Vec3(*along))
        axis.set_function(opensim.LinearFunction(1.0, 0.0))
    kept = (motion.upd_translation1(), motion.upd_translation2(), motion.upd_translation3())
    for axis in kept:
        axis.set_function(opensim.Constant(0.0))
    return motion


def posed(peer: OpenSimTrunk, bends: Array) -> None:
    """Turn joints by (7, 3) rad: extension, right bending, left rotation."""
    coordinates = peer.model.getCoordinateSet()
    for level, angles in zip(LEVELS, bends, strict=True):
        for (name, _), angle in zip(AXES, angles, strict=True):
            coordinates.get(f"{level}_{name}").setValue(peer.state, float(angle), False)
    peer.model.realizePosition(peer.state)


def lengths(peer: OpenSimTrunk, bends: Array) -> Array:
    """(M,) m."""
    posed(peer, bends)
    return np.array([_path(peer, name).getLength(peer.state) for name in peer.names])


def lever_arms(peer: OpenSimTrunk, bends: Array) -> Array:
    """(M, 7, 3) m, OpenSim's own: moment about a coordinate per tension."""
    posed(peer, bends)
    coordinates = peer.model.getCoordinateSet()
    about = [coordinates.get(f"{level}_{name}") for level in LEVELS for name, _ in AXES]
    found = [
        [_path(peer, name).computeMomentArm(peer.state, one) for one in about]
        for name in peer.names
    ]
    return np.array(found).reshape(len(peer.names), len(LEVELS), len(AXES))


def _path(peer: OpenSimTrunk, name: str) -> opensim.GeometryPath:
    actuator = opensim.PathActuator.safeDownCast(peer.model.getForceSet().get(name))
    return opensim.GeometryPath.safeDownCast(actuator.getGeometryPath())
