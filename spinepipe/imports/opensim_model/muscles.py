"""Muscles of an OpenSim model as `trunk_loads` reads them: points, parameters, frames of bodies.

Paths run straight from point to point, and points that come and go with a coordinate are there.
"""

import re
from collections import defaultdict
from collections.abc import Mapping

from spinepipe.effects.contract import Array
from spinepipe.imports.opensim_model.document import ORIGIN
from spinepipe.imports.opensim_model.spine import OsimSpine
from spinepipe.imports.opensim_model.tables import (
    FRAME,
    POINT,
    Rows,
    cells,
    point_cells,
    pose_cells,
)
from spinepipe.muscles.folder import SHEATH
from spinepipe.muscles.myo_sim import GROUPS
from spinepipe.muscles.trunk import SIDES
from spinepipe.report.words import count, listed
from spinepipe.units import MM_PER_M

MUSCLE = "Muscle"
"""End of the names of OpenSim's muscles: Thelen2003Muscle, Millard2012EquilibriumMuscle, ..."""

_KINDS = ("PathPoint", "ConditionalPathPoint")
_SIDE = re.compile(r".*[_.-](r|l|right|left)", re.IGNORECASE)
_MORE_GROUPS = {"E0": "external_oblique", "TR": "transversus_abdominis"}
"""By how names begin in the models of Bruno 2015 and Allaire 2020."""

_PARAMETERS = ("max_isometric_force_n", "optimal_fibre_length_mm", "wrap_objects")


def muscle_tables(
    spine: OsimSpine, specimen: str, own_groups: Mapping[str, str]
) -> tuple[dict[str, Rows], list[str]]:
    """Rows of the tables by file, none where no muscle counts; and sentences."""
    osim, groups = spine.document, {**own_groups, **GROUPS, **_MORE_GROUPS}
    points: Rows = [("muscle", "point", "body", *POINT)]
    parameters: Rows = [("muscle", "group", "side", *_PARAMETERS)]
    out, used, conditional, wrapped = defaultdict[str, list[str]](list), dict[str, None](), 0, 0
    for muscle in osim.objects("ForceSet", MUSCLE):
        name = muscle.get("name", "")
        path = muscle.findall("GeometryPath/PathPointSet/objects/*")
        on = [osim.side(point, "socket_parent_frame", "body") for point in path]
        carriers = {None if one is None else spine.carrier(one[0]) for one in on}
        force = float(osim.numbers(muscle, "max_isometric_force", (1000.0,))[0])
        if None in carriers or len(path) < 2 or any(point.tag not in _KINDS for point in path):
            out["with a point that moves or could not be placed"].append(name)
        elif force <= 0.0:
            out["without force"].append(name)
        elif len(carriers) == 1 and all(one and one[0] != SHEATH for one in on):
            out["that cross no joint between vertebrae"].append(name)
        else:
            places = [
                (body, spine.turn @ pose.apply(osim.numbers(point, "location", ORIGIN)))
                for (body, pose), point in zip(filter(None, on), path, strict=True)
            ]
            for number, (body, at) in enumerate(places):
                points.append((name, number, spine.named.get(body, body), *point_cells(at)))
            used |= dict.fromkeys(body for body, _ in places)
            conditional += sum(point.tag != _KINDS[0] for point in path)
            wraps = " ".join(
                one.findtext("wrap_object", "").strip() for one in muscle.iter("PathWrap")
            )
            wrapped += bool(wraps)
            known = [group for start, group in groups.items() if name.startswith(start)]
            group = known[0] if known else re.split(r"[\d_.-]", name)[0].lower() or name
            fibre = float(osim.numbers(muscle, "optimal_fiber_length", (0.1,))[0]) * MM_PER_M
            parameters.append(
                (name, group, _side(spine, name, places), *cells((force, fibre)), wraps)
            )
    told = [f"Left out: {count(len(n), MUSCLE)} {why}: {listed(n)}." for why, n in out.items()]
    if not used:
        return {}, told
    frames: Rows = [("specimen", "body", "carried_by", *FRAME)]
    for body in used:
        row = (specimen, spine.named.get(body, body), spine.carrier(body))
        frames.append((*row, *pose_cells(spine.ground(body))))
    told.insert(
        0,
        f"{count(len(parameters) - 1, 'muscle')} for trunk_loads, which asks for the stress of the source.",
    )
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


def _side(spine: OsimSpine, name: str, places: list[tuple[str, Array]]) -> str:
    """By the end of the name; else by where it lies."""
    if match := _SIDE.fullmatch(name):
        return next(side for side in SIDES if side[0] == match[1][0].lower())
    across = sum(float(spine.ground(body).apply(at)[2]) for body, at in places)
    return SIDES[across < 0.0]
