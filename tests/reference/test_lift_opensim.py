"""A measured lift by OpenSim's inverse dynamics: the same segments ask the same of L5S1.

Segments hang on a massless body that moves with L5S1, each by a joint of six coordinates; OpenSim
differentiates these itself, by splines.

Catches a force of inertia or a rate of angular momentum with another size, sign or place.
"""

import lifts
import numpy as np
import opensim

from spinepipe.anatomy.segments import GYRATION, MASS_PERCENT, length_m
from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import ratio_sets
from spinepipe.motion.marker_groups import rigid_rotations
from spinepipe.motion.plug_in_gait import HEAD, shoulder_centres
from spinepipe.motion.recorded_motion import CarriedLoads, RecordedMotion, move, net_moments
from spinepipe.motion.skeleton import BODIES
from spinepipe.studies.recorded_motion import places_of, smooth_places
from spinepipe.studies.recordings import trial_rows

SAME_NM, SAME_N = 1.0, 5.0
ENDS = 8
"""Frames at each end, where splines and differences know the motion on one side alone."""

THIN = 1e-6
"""kg m2 about the axis of an arm's segment, about which it is not known to spin."""


def lift() -> tuple[RecordedMotion, dict[str, Array], dict[str, Array]]:
    """The first lift without its box, of which a spline knows nothing while the floor holds it."""
    cohort = lifts.lifts()
    rows = {row["trial"]: row for row in trial_rows(cohort, "s01")}
    stance = {name: at.mean(axis=0) for name, at in places_of(rows["stance"], cohort)[1].items()}
    time_s, places = smooth_places(rows["lift1"], cohort, 6.0)
    shares = ratio_sets()["christophy_2012"]
    return move("lift1", time_s, lifts.spine(), shares, stance, places), stance, places


def turning(
    motion: RecordedMotion, stance: dict[str, Array], places: dict[str, Array]
) -> list[tuple[Array, Array]]:
    """Rotations (F, 3, 3) and inertia (3, 3) kg m2 in the stance, of every part but the load."""
    found = [
        (motion.rotations[:, BODIES.index(part.name)], part.about_com)
        for part in lifts.spine().slices
    ]
    man = lifts.MAN

    def segment(name: str) -> tuple[float, tuple[float, ...]]:
        size = length_m(name, man.sex, man.height_m)
        kg = MASS_PERCENT[f"{name} {man.sex}"] / 100.0 * man.mass_kg
        return kg * size**2, GYRATION[f"{name} {man.sex}"]

    kg, (forwards, right, along) = segment("head")
    model = np.array([stance[name] for name in HEAD])
    seen = np.stack([places[name] for name in HEAD], axis=1)
    head = rigid_rotations(model, seen, np.ones(seen.shape[:2], dtype=bool))[0]
    found.append((head, kg * np.diag([forwards**2, along**2, right**2])))
    for side in "RL":
        wrist = (places[f"{side}WRA"] + places[f"{side}WRB"]) / 2.0
        elbow = places[f"{side}ELB"]
        shoulder = shoulder_centres(places)[side]
        ends = (shoulder, elbow), (elbow, wrist), (wrist, places[f"{side}FIN"])
        for name, (start, end) in zip(("upper_arm", "forearm", "hand"), ends, strict=True):
            kg, (forwards, right, _) = segment(name)
            across = kg * (forwards**2 + right**2) / 2.0
            found.append((_pointing(start - end), np.diag([across, THIN, across])))
    return found


def _pointing(up: Array) -> Array:
    """(F, 3, 3) rotations whose second axis points along (F, 3), turned as little as can be."""
    y = up / np.linalg.norm(up, axis=1, keepdims=True)
    x = np.cross(y, np.broadcast_to([0.0, 0.0, 1.0], y.shape))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def free_joint(name: str, parent: opensim.Frame, body: opensim.Body) -> opensim.CustomJoint:
    """Turned about x, y', z'', then moved: six coordinates whose rates are its speeds."""
    transform = opensim.SpatialTransform()
    for k in range(6):
        axis = transform.updTransformAxis(k)
        axis.setCoordinateNames(opensim.ArrayStr(f"{name}_{k}", 1))
        axis.set_function(opensim.LinearFunction(1.0, 0.0))
        axis.setAxis(opensim.Vec3(*np.eye(3)[k % 3].tolist()))
    return opensim.CustomJoint(name, parent, body, transform)


def by_opensim(motion: RecordedMotion, parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """(F, 3) N and (F, 3) N m about L5S1 that OpenSim asks for."""
    model = opensim.Model()
    model.set_gravity(opensim.Vec3(0.0, -9.81, 0.0))
    root = opensim.Body("root", 0.0, opensim.Vec3(0.0), opensim.Inertia(0.0))
    model.addBody(root)
    model.addJoint(free_joint("base", model.getGround(), root))
    kg = -motion.still.forces[0, :, 1] / 9.81
    courses = [np.zeros_like(motion.l5s1), motion.l5s1]
    loads: CarriedLoads = motion.loads
    for k, (turn, about) in enumerate(parts):
        tensor = opensim.Inertia(
            *(float(about[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        )
        body = opensim.Body(f"part{k}", float(kg[k]), opensim.Vec3(0.0), tensor)
        model.addBody(body)
        model.addJoint(free_joint(f"joint{k}", root, body))
        # angles about x, y', z''
        angles = [
            np.arctan2(-turn[:, 1, 2], turn[:, 2, 2]),
            np.arcsin(turn[:, 0, 2]),
            np.arctan2(-turn[:, 0, 1], turn[:, 0, 0]),
        ]
        courses += [np.unwrap(np.stack(angles, 1), axis=0), loads.at[:, k] - motion.l5s1]
    model.finalizeConnections()
    state = model.initSystem()
    functions = opensim.FunctionSet()
    for course in np.concatenate(courses, axis=1).T:
        spline = opensim.GCVSpline()
        spline.setDegree(5)
        for time, value in zip(motion.time_s.tolist(), course.tolist(), strict=True):
            spline.addPoint(time, value)
        functions.cloneAndAppend(spline)
    solver = opensim.InverseDynamicsSolver(model)
    found = []
    for time in motion.time_s.tolist():
        state.setTime(time)
        vector = solver.solve(state, functions, time)
        found.append([vector.get(k) for k in range(6)])
    moments, forces = np.split(np.array(found), 2, axis=1)
    return forces, moments


def test_opensim_asks_the_same_of_the_lumbosacral_joint() -> None:
    motion, stance, places = lift()
    forces, moments = (one[:, 0] for one in net_moments(motion.joints, motion.loads))
    theirs = by_opensim(motion, turning(motion, stance, places))
    inner = slice(ENDS, -ENDS)
    assert np.abs(theirs[1] - moments)[inner].max() < SAME_NM
    assert np.abs(theirs[0] - forces)[inner].max() < SAME_N
    # what accelerations alone do is far larger than what both differ by
    still = net_moments(motion.joints, motion.still)[1][:, 0]
    assert np.abs(still - moments)[inner].max() > 10.0 * SAME_NM
