"""Bushings of an OpenSim model as `linear_bushing` of the joints in whose frames they lie.

OpenSim counts body-fixed angles x, y', z''; a joint here z, x', y''. In frames turned as those that
our own export writes they are the same, in others they agree to the first order.
"""

from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np
import yaml

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.imports.opensim_model.document import ORIGIN
from spinepipe.imports.opensim_model.spine import OsimSpine
from spinepipe.model.file import ModelFile
from spinepipe.model.osim import BUSHING, BUSHING_AXES
from spinepipe.report.words import count, listed

NEAR = 1e-6
"""m, and sine of an angle, within which a bushing lies in a frame."""

NAME = "BushingForce"


def bushing_model(spine: OsimSpine, cohort: str) -> tuple[dict[str, str], list[str]]:
    """Text of a model file by its name, none where no bushing can be carried; and sentences."""
    total, elsewhere, exact = dict[str, Array](), list[str](), True
    for element in spine.document.objects("ForceSet", NAME):
        if (found := _in_a_joint(spine, element)) is None:
            elsewhere.append(element.get("name", ""))
        else:
            total[found[0]] = total.get(found[0], 0.0) + found[1]
            exact = exact and found[2]
    told = []
    if elsewhere:
        why = "not between neighbouring vertebrae, not in the frame of their joint, or not at rest"
        told = [f"{count(len(elsewhere), NAME)} left out, {why}: {listed(elsewhere)}."]
    if not total:
        return {}, told
    parameters = create(BUSHING).parameters
    inside = {
        joint: [min(max(k, p.low), p.high) for k, p in zip(every.tolist(), parameters, strict=True)]
        for joint, every in total.items()
    }
    values = [
        {"joint": joint, **{p.name: k for p, k in zip(parameters, every, strict=True)}}
        for joint, every in inside.items()
    ]
    entry = {"effect": BUSHING, "scope": {"joints": list(total)}, "values": values}
    model = ModelFile.model_validate({"model": cohort, "cohort": cohort, "effects": [entry]})
    told.append(f"model.yaml: stiffness of {listed(total)} from {NAME}; damping is left out.")
    if any(every != total[joint].tolist() for joint, every in inside.items()):
        told.append("Stiffness out of the range of a bushing here stands as the end of the range.")
    if not exact:
        told.append("Bushings there have another order of angles: small rotations alone agree.")
    return {"model.yaml": yaml.safe_dump(model.model_dump(mode="json"), sort_keys=False)}, told


def _in_a_joint(spine: OsimSpine, element: Element) -> tuple[str, Array, bool] | None:
    """Joint, stiffness (6,) N/m and N m/rad, and whether angles are the same; None elsewhere."""
    osim, pairs = spine.document, list(pairwise(spine.bodies))
    sides = []
    for n in (1, 2):
        pose = (f"location_body_{n}", f"orientation_body_{n}")
        side = osim.side(element, f"socket_frame{n}", f"body_{n}", *pose)
        if side is None or not spine.is_fixed(side[0]):
            return None
        sides.append(side)
    on = [spine.carrier(body) for body, _ in sides]
    joint = next((pair for pair in pairs if {*pair} == {*on}), None)
    if joint is None:
        return None
    at, other, frame = *(spine.ground(*side) for side in sides), spine.joint_frame(joint[1])
    axes = frame.rotation.T @ at.rotation @ spine.turn
    order = np.abs(axes).round()
    off = [at.origin - frame.origin, other.origin - frame.origin, *(other.rotation - at.rotation)]
    if max(np.abs(one).max() for one in (*off, np.abs(axes) - order)) > NEAR:
        return None
    across = order @ osim.numbers(element, "translational_stiffness", ORIGIN)
    about = order @ osim.numbers(element, "rotational_stiffness", ORIGIN)
    same = on[0] == joint[0] and bool(np.abs(axes - BUSHING_AXES).max() < NEAR)
    return joint[1] + joint[0], np.array([*across, about[2], about[0], about[1]]), same
