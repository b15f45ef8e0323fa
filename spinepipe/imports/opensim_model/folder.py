"""An OpenSim model as the tables of a cohort, and in plain sentences what was made of it."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import yaml

from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.documents.names import ALLOWED_FOLDER, folder_fault
from spinepipe.documents.settings import validate
from spinepipe.documents.xml_text import read_xml
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.frames import Pose
from spinepipe.imports.imported import (
    FRAME,
    POINT,
    ImportedCohort,
    Made,
    Rows,
    cells,
    csv_text,
    pose_cells,
)
from spinepipe.imports.opensim_model.document import ORIGIN, OsimDocument, is_on
from spinepipe.imports.opensim_model.forces import FORCES, bushing_model, muscle_tables
from spinepipe.imports.opensim_model.spine import OsimSettings, OsimSpine
from spinepipe.model import Body, RefusedModel
from spinepipe.model.osim import TOKEN_INERTIA_KG_M2, TOKEN_MASS_KG
from spinepipe.model.osim_parts import SIX
from spinepipe.problems import InputError
from spinepipe.report.words import count, listed
from spinepipe.studies.registry import every_form
from spinepipe.units import MM_PER_M

BY_HAND = {
    "specimens.csv": "specimens.csv has the name alone. Put in sex, age, height and mass if a "
    "study asks for them."
}

_INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")
_BODY = ("mass_kg", *(f"com_{one}" for one in POINT), *(f"i{one}_kg_m2" for one in _INERTIA))

_NO_WEIGHT_M_S2 = 1e-3


def imported(folder: Path, document: YamlDocument) -> ImportedCohort:
    """Read the model and make the tables.

    Raises
    ------
    InputError
        With every problem of the settings, else of the file.
    """
    settings, problems = validate(OsimSettings, document)
    if settings is None:
        raise InputError(problems)
    root, problems = read_xml(folder / settings.file, settings.file)
    if root is None:
        raise InputError(problems)
    osim = OsimDocument(root, settings.file)
    if osim.problems:
        raise InputError(osim.problems)
    spine = OsimSpine.of(osim, settings, document)
    own_name = osim.model.get("name", "")
    specimen = settings.specimen or own_name
    if (fault := folder_fault(specimen)) is not None:
        osim.fault(osim.model, "name", fault, ALLOWED_FOLDER, "say `specimen:` in the YAML")
    named = ", ".join(f"{name} is {body}" for name, body in spine.bodies.items())
    told = [f"{count(len(spine.bodies), 'vertebra', 'vertebrae')}: {named}."]
    tables: dict[str, Rows] = {"specimens.csv": [("specimen",), (specimen,)]}
    for made, sentences in (
        _joints(spine, specimen),
        _bodies(spine, specimen),
        _markers(spine, specimen),
        muscle_tables(spine, specimen),
    ):
        tables |= made
        told += sentences
    model, sentences = bushing_model(spine, settings.cohort)
    weighed = {row[1] for row in tables.get("bodies.csv", ())}
    gravity = _pulls(spine) and all(name in weighed for name in [*spine.bodies][1:])
    header = {
        "cohort": settings.cohort,
        "title": settings.title,
        "source": f"{settings.source.rstrip('. ')}. Made by `spinepipe import` of {settings.file}.",
        "vertebrae": list(spine.bodies),
        "gravity": gravity,
    }
    if osim.problems:
        raise InputError(osim.problems)
    text = yaml.safe_dump(header, sort_keys=False, allow_unicode=True, width=110)
    return ImportedCohort(
        name=settings.cohort,
        title=settings.title,
        files={COHORT_YAML: text, **{n: csv_text(rows) for n, rows in tables.items()}, **model},
        by_hand=BY_HAND,
        sentences=(*told, *sentences, f"gravity: {str(gravity).lower()}.", *_not_read(osim)),
        forms=every_form(),
    )


def _pulls(spine: OsimSpine) -> bool:
    """Whether there is weight, which must pull down."""
    osim = spine.document
    pull = spine.turn @ osim.numbers(osim.model, "gravity", (0.0, -9.80665, 0.0))
    if np.hypot(pull[0], pull[2]) + max(pull[1], 0.0) > _NO_WEIGHT_M_S2:
        found = f"{' '.join(cells(pull))}, forwards, up and to the right"
        remedy = "say `axes:` in the YAML, as in `x z -y` where z is up"
        osim.fault(osim.model, "gravity", found, "weight that pulls down", remedy)
    return bool(np.linalg.norm(pull) > _NO_WEIGHT_M_S2)


def _joints(spine: OsimSpine, specimen: str) -> Made:
    rows: Rows = [("specimen", "joint", *FRAME)]
    posed, between = [], []
    for lower, upper in pairwise(spine.bodies):
        frame, (joint, under) = spine.joint_frame(upper), spine.document.below[spine.bodies[upper]]
        between += [] if under == spine.bodies[lower] else [f"{upper}{lower} ({under})"]
        rows.append((specimen, upper + lower, *pose_cells(frame)))
        if min(np.diag(frame.rotation)) <= 0.0:
            found, allowed = "axes that point back, down or left", "x forwards, y up, z right"
            at = spine.document.model
            spine.document.fault(at, f"joint {joint.name}", found, allowed, "say `axes:`")
        if joint.motion is not None and not np.allclose(joint.motion.rotation, np.eye(3)):
            posed.append(upper + lower)
    told = ["Neutral is the model's default pose. Each joint has six coordinates here."]
    if posed:
        told.append(f"Turned by default, frames as the upper side has them: {listed(posed)}.")
    if between:
        told.append(f"Bodies lie between vertebrae, the joint is the upper one: {listed(between)}.")
    return {"joints.csv": rows}, told


def _bodies(spine: OsimSpine, specimen: str) -> Made:
    """Vertebrae with all that is fixed to them; what moves in joints of its own is told."""
    parts, loose = defaultdict[str, list[Body]](list), defaultdict[str, float](float)
    odd, tokens = list[str](), list[str]()
    for name in spine.document.placed:
        carrier = spine.carrier(name)
        body, is_possible = _body(spine, name)
        if carrier is None or body.mass <= 0.0:
            continue
        if body.mass == TOKEN_MASS_KG and np.allclose(
            body.inertia, TOKEN_INERTIA_KG_M2, 0.0, 1e-15
        ):
            tokens.append(name)
            continue
        if not spine.is_fixed(name):
            loose[carrier] += body.mass
            continue
        parts[carrier].append(body)
        odd += [] if is_possible else [name]
    rows: Rows = [("specimen", "vertebra", *_BODY)]
    for name in filter(parts.get, spine.bodies):
        mass = sum(one.mass for one in parts[name])
        com = np.sum([one.mass * one.com for one in parts[name]], axis=0) / mass
        inertia = np.zeros((3, 3))
        for one in parts[name]:
            off = one.com - com
            inertia += one.inertia + one.mass * (off @ off * np.eye(3) - np.outer(off, off))
        rows.append((specimen, name, *cells([mass, *com * MM_PER_M]), *cells(inertia[SIX], 15)))
    told = [f"Inertia left out, none that a body can have: {listed(odd)}."] if odd else []
    if tokens:
        told.append(f"Without mass, 1 g and 1e-6 kg m2 stand for none: {listed(tokens)}.")
    if loose:
        masses = listed(f"{kg:.3g} kg by {name}" for name, kg in loose.items())
        told.append(f"Masses left out, carried on joints of their own: {masses}.")
    return ({"bodies.csv": rows} if len(rows) > 1 else {}), told


def _body(spine: OsimSpine, name: str) -> tuple[Body, bool]:
    """A body in ground, kg, m and kg m2; whether its inertia is one, else it has none."""
    osim, at, element = spine.document, spine.ground(name), spine.document.bodies[name]
    mass = float(osim.numbers(element, "mass", (0.0,))[0])
    six = osim.numbers(element, "inertia", (0.0,) * 6)
    if element.find("inertia_xx") is not None:
        six = np.array([osim.numbers(element, f"inertia_{one}", (0.0,))[0] for one in _INERTIA])
    inertia, axes = np.zeros((3, 3)), at.rotation @ spine.turn
    inertia[SIX] = inertia.T[SIX] = six
    com = at.apply(spine.turn @ osim.numbers(element, "mass_center", ORIGIN))
    try:
        return Body(name, mass, com, axes @ inertia @ axes.T), True
    except RefusedModel:
        return Body(name, max(mass, 0.0), com, np.zeros((3, 3))), False


def _markers(spine: OsimSpine, specimen: str) -> Made:
    """Markers on vertebrae and on what is fixed to them, in the frame of the joint below."""
    osim, rows, elsewhere = spine.document, list[tuple[object, ...]](), Counter[str]()
    first, *upper = spine.bodies
    frames = {name: spine.joint_frame(name) for name in upper}
    frames[first] = Pose(np.eye(3), frames[upper[0]].origin)
    for marker in osim.objects("MarkerSet", "Marker"):
        on = osim.side(marker, "socket_parent_frame", "body")
        carrier = None if on is None else spine.carrier(on[0])
        if on is None or carrier is None or not spine.is_fixed(on[0]):
            elsewhere[on[0] if on else "nothing"] += 1
            continue
        at = spine.turn @ on[1].apply(osim.numbers(marker, "location", ORIGIN))
        at = frames[carrier].inverse().apply(spine.ground(on[0]).apply(at))
        rows.append((specimen, osim.name(marker), carrier, *cells(at * MM_PER_M)))
    told = [f"{count(len(rows), 'marker')} on vertebrae and pelvis."] if rows else []
    if elsewhere:
        bodies = listed(f"{number} on {body}" for body, number in elsewhere.items())
        told.append(f"Markers left out, on what moves by itself: {bodies}.")
    header = ("specimen", "marker", "vertebra", *POINT)
    return ({"marker_set.csv": [header, *rows]} if rows else {}), told


def _not_read(osim: OsimDocument) -> Iterator[str]:
    """What there is in the model besides."""
    if lost := [name for name in osim.bodies if name not in osim.placed]:
        yield f"Not placed, on joints of a form that is not read: {listed(lost)}."
    sets = [one for one in osim.model if one.tag.endswith("Set")]
    kinds = Counter(
        one.tag
        for group in sets
        if group.tag not in ("BodySet", "JointSet", "MarkerSet")
        for one in group.iterfind("objects/*")
        if not (re.fullmatch("|".join(FORCES), one.tag) and is_on(one))
    )
    used = {one.findtext("wrap_object", "").strip() for one in osim.model.iter("PathWrap")}
    wraps = osim.model.iterfind(".//WrapObjectSet/objects/*")
    kinds.update(f"{one.tag} that no path uses" for one in wraps if one.get("name") not in used)
    if kinds:
        every = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
        yield f"Not read: {every}."
