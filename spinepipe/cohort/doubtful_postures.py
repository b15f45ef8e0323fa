"""Joints that face or lie as in no spine: upside down, out of order, columns or signs exchanged.

The axes of joint frames and the line through their origins tell of the same curve. Where they do
not agree, and do once columns are exchanged, a sign is turned or radians are taken for degrees,
that is suspected.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from spinepipe.anatomy.levels import (
    LEAN_DEG,
    PEDICLES_MM,
    TURN_DEG,
    extension_range_deg,
    is_level,
)
from spinepipe.cohort.answers import of_specimens
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.cohort.neutral_pose import NeutralPose
from spinepipe.cohort.specimen import landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, rotation_zxy, zxy_angles
from spinepipe.problems import Problem
from spinepipe.units import MM_PER_M

STRAY_DEG = 5.0
"""Root mean square angle between the line of joints and their axes: at most so in good spines."""

ASKEW_DEG = 30.0
"""And beyond which it is told whatever is behind it."""

BETTER = 2.0
"""Times that a suspected mistake must bring them nearer together."""

RADIANS = 1.1
"""No orientation of a spine in radians is larger: 60 deg."""

LEAST_SINE = 0.5
"""Pedicle line and endplate line are square in a vertebra; here 30 deg."""

BEHIND_MM = 3.0
"""Pedicles lie behind the middle of the body, by 8 mm and more."""

LEAST_ACROSS = 0.4
"""Of the way from left to right lies along z: 0.75 in vertebrae turned by 41 deg."""

ANGLES = ("extension_deg", "right_bending_deg", "left_rotation_deg")
XYZ = ("x_mm", "y_mm", "z_mm")


def doubtful_postures(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[Doubt]:
    """Doubts about axes and order of joints, where vertebrae are levels of the spine."""
    named = [pose for pose in poses if all(map(is_level, pose.vertebrae))]
    told = dict[tuple[str, str], list[str]]()
    below = [(pose.specimen, joint) for pose in named for joint in _below(cohort, pose)]
    if below:
        yield _order(cohort, below)
    for pose in named:
        if any(specimen == pose.specimen for specimen, _ in below):
            continue
        suspect = _suspect(cohort, pose)
        if suspect is not None:
            told.setdefault(suspect, []).append(pose.specimen)
        else:
            yield from _axes(cohort, pose)
    for (words, column), specimens in told.items():
        yield _of_suspect(cohort, words, column, specimens)


def _stem(cohort: Cohort) -> str:
    return "landmarks" if cohort.joints is None else "joints"


def _line(cohort: Cohort, specimen: str, joint: str) -> int | None:
    """Of the first row of a joint or, of landmarks, of its upper vertebra."""
    stem = _stem(cohort)
    table = getattr(cohort, stem)
    at = cohort.joint_names.index(joint)
    found = (
        table["joint"] == joint
        if stem == "joints"
        else table["vertebra"] == cohort.vertebrae[at + 1]
    )
    rows = np.flatnonzero(found & (table["specimen"] == specimen))
    return first_line(cohort, stem, int(rows[0])) if len(rows) else None


def _below(cohort: Cohort, pose: NeutralPose) -> Iterator[str]:
    """Joints below the one that they should be above."""
    for index, (below, above) in enumerate(pairwise(pose.origins)):
        up = pose.rotations[index][:, 1] + pose.rotations[index + 1][:, 1]
        if float((above - below) @ up) <= 0.0:
            yield cohort.joint_names[index + 1]


def _order(cohort: Cohort, below: Sequence[tuple[str, str]]) -> Doubt:
    specimen, joint = below[0]
    place = (file_of(cohort, _stem(cohort)), _line(cohort, specimen, joint), "y_mm")
    under = cohort.joint_names[cohort.joint_names.index(joint) - 1]
    more = f", and {len(below) - 1} more joints so" if below[1:] else ""
    found = f"{joint} of {specimen} below {under}{more}"
    remedy = "suspected: joints or vertebrae exchanged, or y counted downwards; correct it"
    allowed = "joints one above the other, as cohort.yaml lists them, along +y of their axes"
    return Doubt(Problem(*place, found, allowed, remedy), "postures", certain=True)


def _suspect(cohort: Cohort, pose: NeutralPose) -> tuple[str, str] | None:
    """What makes line and axes of a specimen disagree, and its column; None where they agree."""
    here = _stray_deg(pose.origins, pose.rotations)
    angles = np.rad2deg(zxy_angles(pose.rotations))
    largest = float(np.abs(angles).max())
    if cohort.joints is not None and len(angles) > 1 and 1e-3 < largest < RADIANS:
        return "suspected: orientations in radians and not degrees (0.0175); convert", ANGLES[0]
    if here <= STRAY_DEG:
        return None
    tried = _tried(pose, angles)
    best = min(tried, key=lambda one: _stray_deg(*tried[one]))
    if len(pose.origins) > 2 and _stray_deg(*tried[best]) * BETTER < here:
        return best
    if here > ASKEW_DEG:
        return "look for exchanged columns, and whether axes are those of ground", XYZ[0]
    return None


def _tried(pose: NeutralPose, angles: Array) -> dict[tuple[str, str], tuple[Array, Array]]:
    """Origins and rotations as they would be without each mistake, by its words and column."""
    found = {}
    for first, second in ((0, 1), (1, 2), (0, 2)):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        words = f"suspected: {XYZ[first]} and {XYZ[second]} exchanged"
        found[words, XYZ[first]] = (pose.origins[:, order], pose.rotations)
        words = f"suspected: {ANGLES[first]} and {ANGLES[second]} exchanged"
        found[words, ANGLES[first]] = (pose.origins, _rotations(angles[:, order]))
    for axis in (0, 2):
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        found[f"suspected: the sign of {XYZ[axis]}", XYZ[axis]] = (
            pose.origins * sign,
            pose.rotations,
        )
    for index in (0, 1):
        sign = np.where(np.arange(3) == index, -1.0, 1.0)
        words = f"suspected: the sign of {ANGLES[index]}"
        found[words, ANGLES[index]] = (pose.origins, _rotations(angles * sign))
    return found


def _rotations(angles_deg: Array) -> Array:
    return np.array([rotation_zxy(*one) for one in np.deg2rad(angles_deg)])


def _stray_deg(origins: Array, rotations: Array) -> float:
    """Root mean square angle between the line from joint to joint and the mean of their y axes."""
    if len(origins) < 2:
        return 0.0
    lines = np.diff(origins, axis=0)
    up = rotations[1:, :, 1] + rotations[:-1, :, 1]
    sizes = np.linalg.norm(lines, axis=1) * np.linalg.norm(up, axis=1)
    cosines = np.sum(lines * up, axis=1) / np.maximum(sizes, 1e-12)
    return float(np.rad2deg(np.sqrt(np.mean(np.arccos(np.clip(cosines, -1.0, 1.0)) ** 2))))


def _of_suspect(cohort: Cohort, words: str, column: str, specimens: Sequence[str]) -> Doubt:
    place = (file_of(cohort, _stem(cohort)), _line(cohort, specimens[0], cohort.joint_names[0]))
    whose = of_specimens(specimens, cohort.specimen_names)
    found = f"axes of joints that do not follow the line through their origins ({whose})"
    allowed = f"y axes along that line within {STRAY_DEG:g} deg"
    return Doubt(Problem(*place, column, found, allowed, words), "postures")


def _axes(cohort: Cohort, pose: NeutralPose) -> Iterator[Doubt]:
    """Joints that lean or turn as those of no spine, by level."""
    angles = np.rad2deg(zxy_angles(pose.rotations))
    for index, (joint, own) in enumerate(zip(cohort.joint_names, angles, strict=True)):
        extension = extension_range_deg(pose.vertebrae[index])
        ranges = (extension, (-LEAN_DEG, LEAN_DEG), (-TURN_DEG, TURN_DEG))
        for name, angle, limits in zip(ANGLES, own, ranges, strict=True):
            if limits is None or limits[0] <= angle <= limits[1]:
                continue
            place = (file_of(cohort, _stem(cohort)), _line(cohort, pose.specimen, joint))
            found = f"{joint} of {pose.specimen} turned by {angle:.3g} deg ({name})"
            allowed = f"{limits[0]:g} to {limits[1]:g} deg at this level"
            remedy = "look for exchanged columns and signs"
            column = name if cohort.joints is not None else None
            yield Doubt(Problem(*place, column, found, allowed, remedy), "postures")


def doubtful_shapes(cohort: Cohort) -> Iterator[Doubt]:
    """Vertebrae whose four landmarks are those of no vertebra, one line for each fault."""
    table = cohort.landmarks
    if table is None:
        return
    found: dict[tuple[str, str, bool], list[tuple[str, str]]] = defaultdict(list)
    for specimen in cohort.specimen_names:
        for vertebra, points in landmarks(cohort, specimen).items():
            if is_level(vertebra) and all(name in points for name in FRAME_LANDMARKS):
                fault = _fault({name: p * MM_PER_M for name, p in points.items()})
                if fault is not None:
                    found[fault].append((specimen, vertebra))
    for (words, remedy, certain), places in found.items():
        specimen, vertebra = places[0]
        rows = np.flatnonzero((table["specimen"] == specimen) & (table["vertebra"] == vertebra))
        line = first_line(cohort, "landmarks", int(rows[0]))
        shown = ", ".join(f"{v} of {s}" for s, v in places[:3]) + (", …" if places[3:] else "")
        allowed = "pedicle bases to the sides of the body and behind it, endplates above each other"
        problem = Problem(
            file_of(cohort, "landmarks"), line, "x_mm", f"{words} ({shown})", allowed, remedy
        )
        yield Doubt(problem, "postures", certain)


def doubtful_sides(cohort: Cohort) -> Iterator[Doubt]:
    """Landmarks of a left and a right side that do not lie to the left and right of each other."""
    for specimen in cohort.specimen_names if cohort.landmarks is not None else ():
        across = [
            points[name.replace("left", "right", 1)] - point
            for vertebra, points in landmarks(cohort, specimen).items()
            for name, point in points.items()
            if is_level(vertebra) and name.startswith("left_")
            if name.replace("left", "right", 1) in points
        ]
        length = sum(float(np.linalg.norm(one)) for one in across)
        if length > 0.0 and float(np.sum(across, axis=0)[2]) < LEAST_ACROSS * length:
            table = cohort.landmarks
            assert table is not None
            row = int(np.flatnonzero(table["specimen"] == specimen)[0])
            place = (file_of(cohort, "landmarks"), first_line(cohort, "landmarks", row), "z_mm")
            found = f"landmarks of the right side not to the right of the left ones ({specimen})"
            remedy = "suspected: columns exchanged, or left and right; exchange them back"
            yield Doubt(Problem(*place, found, "right sides along +z", remedy), "postures")


def _fault(points: Mapping[str, Array]) -> tuple[str, str, bool] | None:
    """What is wrong with the landmarks (mm) of a vertebra, the remedy, and whether for certain."""
    top, bottom, left, right = (points[name] for name in FRAME_LANDMARKS)
    across, up = right - left, top - bottom
    sizes = float(np.linalg.norm(across)), float(np.linalg.norm(up))
    forward = np.cross(up, across) / max(sizes[0] * sizes[1], 1e-12)
    sine = float(np.linalg.norm(forward))
    remedy = "look for a misplaced landmark"
    if sine < LEAST_SINE:
        return "landmarks nearly on one line", remedy, True
    behind = (left + right) / 2.0 - (top + bottom) / 2.0
    if float(behind @ forward) / sine > BEHIND_MM:
        told = "suspected: two columns exchanged, the sign of one, or left and right; correct it"
        return "pedicles in front of the body", told, True
    if not PEDICLES_MM[0] <= sizes[0] <= PEDICLES_MM[1]:
        return "pedicle bases too near or too far apart", remedy, False
    return None
