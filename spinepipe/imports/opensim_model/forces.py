"""Muscles and bushings of an OpenSim model, as `trunk_loads` and a model file have them.

Paths of muscles run straight from point to point, and points that come and go with a coordinate are
there. A bushing is a `linear_bushing` where it lies in the frame of a joint. OpenSim counts its
angles body-fixed x, y', z'', a joint here z, x', y'': in frames turned as our own export writes
them these are the same, in others to the first order.
"""

import re
from collections import defaultdict
from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np
import yaml

from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.imports.imported import FRAME, POINT, Made, Rows, cells, pose_cells
from spinepipe.imports.opensim_model.document import ORIGIN
from spinepipe.imports.opensim_model.spine import OsimSpine
from spinepipe.model.file import ModelFile
from spinepipe.model.osim import BUSHING, BUSHING_AXES
from spinepipe.muscles.folder import SHEATH
from spinepipe.muscles.myo_sim import GROUPS
from spinepipe.muscles.trunk import SIDES
from spinepipe.report.words import count, listed
from spinepipe.units import MM_PER_M

FORCES = MUSCLE, BUSHING_FORCE = r"\w*Muscle", "BushingForce"
"""Tags of OpenSim's forces that are read, such as Thelen2003Muscle."""

_KINDS = ("PathPoint", "ConditionalPathPoint")
_GROUPS = {**GROUPS, "E0": "external_oblique", "TR": "transversus_abdominis"}
"""By how names begin, also in the models of Bruno 2015 and Allaire 2020."""

_PARAMETERS = ("max_isometric_force_n", "optimal_fibre_length_mm", "wrap_objects")


def muscle_tables(spine: OsimSpine, specimen: str) -> Made:
    """Rows of the tables by file, none where no muscle counts; and sentences."""
    osim = spine.document
    points: Rows = [("muscle", "point", "body", *POINT)]
    parameters: Rows = [("muscle", "group", "side", *_PARAMETERS)]
    out, used, conditional, wrapped = defaultdict[str, list[str]](list), dict[str, None](), 0, 0
    for muscle in osim.objects("ForceSet", MUSCLE):
        name = osim.name(muscle)
        path = muscle.findall("GeometryPath/PathPointSet/objects/*")
        on = [osim.side(point, "socket_parent_frame", "body") for point in path]
        carriers = {None if one is None else spine.carrier(one[0]) for one in on}
        force = float(osim.numbers(muscle, "max_isometric_force", (1000.0,))[0])
        if None in carriers or len(path) < 2 or any(point.tag not in _KINDS for point in path):
            out["with a point that moves or has no place"].append(name)
        elif force <= 0.0:
            out["without force"].append(name)
        elif len(carriers) == 1 and all(one and one[0] != SHEATH for one in on):
            out["across no joint between vertebrae"].append(name)
        else:
            places = [
                (body, spine.turn @ pose.apply(osim.numbers(point, "location", ORIGIN)))
                for (body, pose), point in zip(filter(None, on), path, strict=True)
            ]
            for number, (body, at) in enumerate(places):
                points.append((name, number, spine.named.get(body, body), *cells(at * MM_PER_M)))
            used |= dict.fromkeys(body for body, _ in places)
            conditional += sum(point.tag != _KINDS[0] for point in path)
            wraps = " ".join(
                one.findtext("wrap_object", "").strip() for one in muscle.iter("PathWrap")
            )
            wrapped += bool(wraps)
            known = [group for start, group in _GROUPS.items() if name.startswith(start)]
            group = known[0] if known else re.split(r"[\d_.-]", name)[0].lower() or name
            fibre = float(osim.numbers(muscle, "optimal_fiber_length", (0.1,))[0]) * MM_PER_M
            across = sum(float(spine.ground(body).apply(at)[2]) for body, at in places)
            side = SIDES[across < 0.0]
            parameters.append((name, group, side, *cells((force, fibre)), wraps))
    told = [f"Left out: {count(len(n), 'muscle')} {why}: {listed(n)}." for why, n in out.items()]
    if not used:
        return {}, told
    frames: Rows = [("specimen", "body", "carried_by", *FRAME)]
    for body in used:
        row = (specimen, spine.named.get(body, body), spine.carrier(body))
        frames.append((*row, *pose_cells(spine.ground(body))))
    taken = count(len(parameters) - 1, "muscle")
    told.insert(0, f"{taken} for trunk_loads; its study must say source_stress_mpa.")
    if wrapped:
        told.append(f"{count(wrapped, 'muscle')} run over wrap objects, here straight past them.")
    if conditional:
        told.append(f"{count(conditional, _KINDS[1])} taken as there in every posture.")
    if loose := [body for body in used if not spine.is_fixed(body)]:
        told.append(f"Moved with a vertebra, though on joints of their own: {listed(loose)}.")
    return {
        "muscles.csv": points,
        "muscle_parameters.csv": parameters,
        "body_frames.csv": frames,
    }, told


NEAR = 1e-6
"""m, and sine of an angle, within which a bushing lies in a frame."""


def bushing_model(spine: OsimSpine, cohort: str) -> tuple[dict[str, str], list[str]]:
    """Text of a model file by its name, none where no bushing can be carried; and sentences."""
    total, elsewhere, exact = dict[str, Array](), list[str](), True
    for element in spine.document.objects("ForceSet", BUSHING_FORCE):
        if (found := _in_a_joint(spine, element)) is None:
            elsewhere.append(element.get("name", ""))
        else:
            total[found[0]] = total.get(found[0], 0.0) + found[1]
            exact = exact and found[2]
    told = []
    if elsewhere:
        why = "not between neighbouring vertebrae, not in the frame of their joint, or not at rest"
        told = [f"{count(len(elsewhere), BUSHING_FORCE)} left out, {why}: {listed(elsewhere)}."]
    if not total:
        return {}, told
    parameters = create(BUSHING).parameters
    low, high = np.array([(one.low, one.high) for one in parameters]).T
    inside = {joint: np.clip(k, low, high) for joint, k in total.items()}
    names = [one.name for one in parameters]
    values = [
        {"joint": joint, **dict(zip(names, k.tolist(), strict=True))} for joint, k in inside.items()
    ]
    entry = {"effect": BUSHING, "scope": {"joints": list(total)}, "values": values}
    model = ModelFile.model_validate({"model": cohort, "cohort": cohort, "effects": [entry]})
    told.append(
        f"model.yaml: stiffness of {listed(total)} from {BUSHING_FORCE}; damping is left out."
    )
    if any((k != total[joint]).any() for joint, k in inside.items()):
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
