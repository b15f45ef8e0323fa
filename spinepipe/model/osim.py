"""A spine model as an OpenSim 4 document: custom joints with bushings, written without OpenSim.

All body frames lie on ground in the neutral pose, so centres of mass, inertias and load points
stand in the file as the model has them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import osim_parts as parts
from spinepipe.model.osim_parts import numbers, told
from spinepipe.model.spine import LoadCase, ScopedEffect, SpineModel

BUSHING = "linear_bushing"

BUSHING_AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""(3, 3) columns: x, y, z of a bushing's frames in joint axes, which are the joint's z, x, y.

BushingForce resists body-fixed X-Y'-Z'' angles and the loads conjugate to them. In frames turned
so, these are the joint's own Z-X'-Y'' angles, and the bushing is exactly k_i q_i + c_i dq_i/dt.
"""

BUSHING_TRANSLATIONS = (2, 0, 1)
"""Joint translations (x, y, z) in the order of a bushing's axes."""

ALONE = 0.036
"""m from joint to joint, where there is one only: that of lumbar vertebrae."""

TOKEN_MASS_KG = 1e-3
TOKEN_INERTIA_KG_M2 = 1e-6 * np.eye(3)
"""OpenSim cannot move a body without mass or inertia; at rest neither of these loads a joint."""


def expressible(
    model: SpineModel, loads: LoadCase | None = None
) -> tuple[SpineModel, tuple[str, ...]]:
    """The model as far as an .osim file can say it, and the names of what it cannot.

    Said are linear bushings that act in the test of ``loads``, without one in all tests.
    """
    said, unsaid = list[ScopedEffect](), dict[str, None]()
    for one in model.effects:
        if one.effect.name == BUSHING and (loads or one.tests == ("*",)):
            said += [one] if loads is None or one.in_scope(loads.test) else []
        elif loads is None or one.in_scope(loads.test):
            unsaid[one.effect.name] = None
    if loads is not None and loads.fixed:
        unsaid["coordinates that the rig fixes"] = None
    return replace(model, effects=tuple(said)), tuple(unsaid)


def times(loads: LoadCase) -> Array:
    """(T,) s: as recorded, else one second a step where not all are or where they do not rise."""
    recorded = [step.time for step in loads.steps if step.time is not None]
    if len(recorded) == len(loads.steps) and all(a < b for a, b in pairwise(recorded)):
        return np.array(recorded)
    return np.array([float(step.step) for step in loads.steps])


def osim(
    model: SpineModel,
    loads: LoadCase | None = None,
    points: Mapping[str, Mapping[str, Array]] | None = None,
) -> str:
    """OpenSim document of a model, readable by OpenSim 4.0 and later.

    Coordinates are named after joint and coordinate, e.g. ``L3L4_anterior`` (m, rad); the lowest
    vertebra is ground. A body without mass or without inertia, which the model allows only where
    neither matters, gets 1 g or 1e-6 kg m2, and ``credits`` in the file says which, as well as what
    of the model is not `expressible`.

    Parameters
    ----------
    loads : written as prescribed forces: constant for one step, else piecewise linear through the
        steps at their recorded times, or at one second per step number when not all are recorded.
    points : (3,) m in ground by vertebra and name: markers, such as ``L4_left_pedicle_base``. Those
        of another vertebra than the model's bodies are on ground.

    Raises
    ------
    RefusedModel
        Of a name that OpenSim cannot take.
    """
    model, left_out = expressible(model, loads)
    stiffness = np.zeros((model.n_joints, 6))  # N/m and N m/rad, summed over bushings
    for scoped in model.effects:
        np.add.at(stiffness, list(scoped.joints), scoped.values)
    points = points or {}
    names = (*model.joints, *(body.name for body in model.bodies), *points)
    root, (bodies, joints, forces, markers) = parts.document(
        *(model.specimen, _credits(model, left_out), model.gravity),
        *(("Body", "Joint", "Force", "Marker"), names),
    )
    paths = ("/ground", *(f"/bodyset/{body.name}" for body in model.bodies))
    ends = [frame.origin for frame in model.frames]
    last = model.frames[-1].rotation[:, 1]
    ends.append(2 * ends[-1] - ends[-2] if len(ends) > 1 else ends[-1] + ALONE * last)
    for j, (lower, upper) in enumerate(pairwise(paths)):
        body, frame = model.bodies[j], model.frames[j]
        inertia = body.inertia if body.inertia.any() else TOKEN_INERTIA_KG_M2
        drawn = frame, ends[j + 1]
        bodies.append(parts.body(body.name, body.mass or TOKEN_MASS_KG, body.com, inertia, *drawn))
        joints.append(parts.joint(model.joints[j], (lower, frame), (upper, frame)))
        forces.append(_bushing(model, j, (lower, upper), stiffness[j]))
    forces.extend([] if loads is None else _prescribed_forces(loads, paths[1:]))
    on = {body.name: path for body, path in zip(model.bodies, paths[1:], strict=True)}
    for vertebra, places in points.items():
        for name, at in places.items():
            markers.append(parts.marker(f"{vertebra}_{name}", on.get(vertebra, paths[0]), at))
    return parts.written(root)


def _credits(model: SpineModel, left_out: Sequence[str]) -> str:
    massless = [body.name for body in model.bodies if body.mass == 0.0]
    inertialess = [body.name for body in model.bodies if not body.inertia.any()]
    text = ""
    if massless:
        text += f" Without mass in the model, 1 g here: {', '.join(massless)}."
    if inertialess:
        text += f" Without inertia in the model, 1e-6 kg m2 here: {', '.join(inertialess)}."
    if left_out:
        text += f" In the model and not in this file: {', '.join(left_out)}."
    return text


def _bushing(model: SpineModel, j: int, paths: tuple[str, str], stiffness: Array) -> Element:
    """Stiffness and damping (6,) of a joint between two bodies, by the axes of a bushing."""
    element = Element("BushingForce", name=f"{model.joints[j]}_bushing")
    told(element, "socket_frame1", "lower")
    told(element, "socket_frame2", "upper")
    frame = model.frames[j]
    turned = Pose(frame.rotation @ BUSHING_AXES, frame.origin)
    element.append(parts.offset_frames((paths[0], turned), (paths[1], turned)))
    for kind, values in (("stiffness", stiffness), ("damping", model.damping[j])):
        told(element, f"rotational_{kind}", numbers(values[3:]))
        told(element, f"translational_{kind}", numbers(values[list(BUSHING_TRANSLATIONS)]))
    return element


def _prescribed_forces(loads: LoadCase, paths: Sequence[str]) -> list[Element]:
    """One prescribed force per loaded point, its components as functions of time."""
    seconds = times(loads).tolist()
    wrenches: dict[tuple[int, tuple[float, ...]], Array] = {}
    for number, step in enumerate(loads.steps):
        for wrench in step.wrenches:
            place = (wrench.body, tuple(wrench.point.tolist()))
            history = wrenches.setdefault(place, np.zeros((len(loads.steps), 6)))
            history[number] += np.concatenate([wrench.force, wrench.moment])
    elements = []
    for number, ((body, point), history) in enumerate(wrenches.items()):
        element = Element("PrescribedForce", name=f"load_{number}")
        told(element, "socket_frame", paths[body])
        told(element, "pointIsGlobal", "false")
        told(element, "forceIsGlobal", "true")
        constant = np.tile(point, (len(seconds), 1))
        columns = {"force": history[:, :3], "point": constant, "torque": history[:, 3:]}
        for kind, values in columns.items():
            functions = SubElement(element, "FunctionSet", name=f"{kind}Functions")
            each = (_function(seconds, of.tolist()) for of in values.T)
            SubElement(functions, "objects").extend(each)
        elements.append(element)
    return elements


def _function(times: Sequence[float], values: Sequence[float]) -> Element:
    """Lines through the values: level outside, as OpenSim extends the end pieces."""
    element = Element("PiecewiseLinearFunction")
    told(element, "x", numbers([times[0] - 1.0, *times, times[-1] + 1.0]))
    told(element, "y", numbers([values[0], *values, values[-1]]))
    return element
