"""Joints that face or lie as in no spine: upside down, out of order, columns or signs exchanged.

The axes of joint frames and the line through their origins tell of the same curve. Where they do
not agree, and do once columns are exchanged, a sign is turned or radians are taken for degrees,
that is suspected.
"""

from collections import defaultdict
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from spinepipe.anatomy.levels import (
    EXTENSION_DEG,
    LEAN_DEG,
    PEDICLES_MM,
    TURN_DEG,
    extension_range_deg,
    is_level,
)
from spinepipe.cohort.answers import of_specimens
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt, Found
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.cohort.exchanged_landmarks import Suspect, exchange, suspect
from spinepipe.cohort.neutral_pose import NeutralPose
from spinepipe.cohort.specimen import landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, rotation_zxy, zxy_angles
from spinepipe.problems import Problem
from spinepipe.units import MM_PER_M

STRAY_DEG = 5.0
"""Root mean square angle between the line of joints and their axes: at most so in good spines."""

ASKEW_DEG = 20.0
"""And beyond which it is told whatever is behind it."""

BETTER = 2.0
"""Times that a suspected mistake must bring them nearer together."""

AS_GOOD_DEG, AS_GOOD_SDS = 2.0, 0.5
"""Two suspects that bring them as near together, and make spines as likely, are both named."""

ASIDE_MM = 30.0
"""What is above a joint lies so far aside where a spine was scanned in two pieces."""

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


def doubtful_postures(cohort: Cohort, poses: Sequence[NeutralPose]) -> Found:
    """Doubts about axes and order of joints, where vertebrae are levels of the spine."""
    told = dict[tuple[str, str, bool], list[str]]()
    single: dict[str, list[Doubt]] = {}
    for pose in poses:
        if not all(map(is_level, pose.vertebrae)):
            continue
        below = list(_below(cohort, pose))
        suspected = _out_of_order(cohort, pose, below[0]) if below else _suspect(cohort, pose)
        if suspected is not None:
            told.setdefault((*suspected, bool(below)), []).append(pose.specimen)
        elif odd := list(_axes(cohort, pose)):
            single[pose.specimen] = odd
    found = [_of_suspect(cohort, *key, specimens) for key, specimens in told.items()]
    found += [doubt for doubts in single.values() for doubt in doubts]
    return Found.of(found, [*single, *(name for names in told.values() for name in names)])


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


def _out_of_order(cohort: Cohort, pose: NeutralPose, first: str) -> tuple[str, str]:
    """What makes a joint lie below the one that it should be above, and the column."""
    best = _best(
        _tried(pose) | _other_names(cohort, pose), _stray_deg(pose.origins, pose.rotations)
    )
    if best is not None:
        return best
    under = cohort.joint_names[cohort.joint_names.index(first) - 1]
    words = (
        f"look at {first}, which lies below {under}: joints or vertebrae exchanged, or misplaced"
    )
    return words, "y_mm"


def _suspect(cohort: Cohort, pose: NeutralPose) -> tuple[str, str] | None:
    """What makes line and axes of a specimen disagree, and its column; None where they agree."""
    here = _stray_deg(pose.origins, pose.rotations)
    largest = float(np.abs(np.rad2deg(zxy_angles(pose.rotations))).max())
    if cohort.joints is not None and len(pose.origins) > 1 and 1e-3 < largest < RADIANS:
        return "suspected: orientations in radians and not degrees; multiply by 57.3", ANGLES[0]
    if here <= STRAY_DEG:
        return None
    found = _best(_tried(pose), here) if len(pose.origins) > 2 else None
    if found is None and (gap := _apart(cohort, pose)) is not None:
        return gap
    if found is None and here > ASKEW_DEG:
        return "look for exchanged columns, and whether axes are those of ground", XYZ[0]
    return found


_Tried = dict[tuple[str, str], NeutralPose]
"""Words and column of a mistake, and how joints would stand without it."""


def _best(tried: _Tried, here_deg: float) -> tuple[str, str] | None:
    """The mistake without which line and axes agree best; of two as good both are named.

    Of those as good that one whose spine then stands more as spines do at their levels.
    """
    stray = {one: _stray_deg(p.origins, p.rotations) for one, p in tried.items() if not _upset(p)}
    if not stray or min(stray.values()) * BETTER > here_deg:
        return None
    near = [one for one, deg in stray.items() if deg < min(stray.values()) + AS_GOOD_DEG]
    odd = {one: _unlike_a_spine(tried[one]) for one in near}
    best = min(near, key=lambda one: odd[one])
    as_good = [one for one in near if odd[one] < odd[best] + AS_GOOD_SDS and one != best]
    words = ", or ".join([best[0], *(one[0] for one in as_good[:1])])
    return f"suspected: {words}; correct it", best[1]


def _upset(pose: NeutralPose) -> bool:
    """Whether a joint lies below the one that it should be above, or an axis is turned over."""
    lines = np.diff(pose.origins, axis=0)
    up = pose.rotations[1:, :, 1] + pose.rotations[:-1, :, 1]
    return bool(np.any(np.sum(lines * up, axis=1) <= 0.0) or np.any(lines[:, 1] <= 0.0))


def _unlike_a_spine(pose: NeutralPose) -> float:
    """Root mean square extension beyond the mean of each level, in SDs, however it is mounted."""
    angles = np.rad2deg(zxy_angles(pose.rotations))
    rows = [EXTENSION_DEG[name] for name in pose.vertebrae[:-1] if name in EXTENSION_DEG]
    if len(rows) < len(angles):
        return 0.0
    means, sds = np.array(rows).T
    off = angles[:, 0] - means
    return float(np.sqrt(np.mean(((off - off.mean()) / sds) ** 2)))


def _apart(cohort: Cohort, pose: NeutralPose) -> tuple[str, str] | None:
    """Where all that is above one joint lies aside, as of a scan in two pieces."""
    lines = np.diff(pose.origins, axis=0)
    up = pose.rotations[1:, :, 1] + pose.rotations[:-1, :, 1]
    up /= np.linalg.norm(up, axis=1)[:, None]
    aside = lines - np.sum(lines * up, axis=1)[:, None] * up
    sizes = np.linalg.norm(aside, axis=1)
    gap = int(np.argmax(sizes))
    near = max(range(len(sizes)), key=lambda k: sizes[k] if abs(k - gap) == 1 else -1.0)
    whole = aside[gap] + aside[near]  # a joint halfway between two vertebrae has half of each
    rest = np.delete(sizes, [gap, near])
    if np.linalg.norm(whole) < ASIDE_MM or np.any(rest > ASIDE_MM / 3.0):
        return None
    above = cohort.joint_names[max(gap, near if sizes[near] > ASIDE_MM / 3.0 else 0) + 1]
    words = (
        f"suspected: {above} of {pose.specimen} and all above it misplaced by "
        f"{np.linalg.norm(whole):.0f} mm, as of a scan in two pieces"
    )
    return words, XYZ[int(np.argmax(np.abs(whole)))]


def _tried(pose: NeutralPose) -> _Tried:
    """How joints would stand without each mistake of columns."""
    found: _Tried = {}
    angles = np.rad2deg(zxy_angles(pose.rotations))

    def put(words: str, column: str, origins: Array, rotations: Array) -> None:
        found[words, column] = replace(pose, origins=origins, rotations=rotations)

    for first, second in ((0, 1), (1, 2), (0, 2)):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        words = f"{XYZ[first]} and {XYZ[second]} exchanged"
        put(words, XYZ[first], pose.origins[:, order], pose.rotations)
        words = f"{ANGLES[first]} and {ANGLES[second]} exchanged"
        put(words, ANGLES[first], pose.origins, _rotations(angles[:, order]))
    for axis, words in enumerate(("backwards", "downwards", "to the left")):
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        told = f"the sign of {XYZ[axis]}: counted {words}"
        put(told, XYZ[axis], pose.origins * sign, pose.rotations)
    for index in (0, 1):
        sign = np.where(np.arange(3) == index, -1.0, 1.0)
        put(f"the sign of {ANGLES[index]}", ANGLES[index], pose.origins, _rotations(angles * sign))
    return found


def _other_names(cohort: Cohort, pose: NeutralPose) -> _Tried:
    """The same joints in the order in which they lie, where one exchange of names makes it."""
    order = np.argsort(pose.origins[:, 1])
    wanted = [cohort.joint_names[k] for k in order]
    words = exchange(cohort.joint_names, wanted)
    if words is None:
        return {}
    stem = "vertebrae" if cohort.joints is None else "joints"
    moved = replace(pose, origins=pose.origins[order], rotations=pose.rotations[order])
    return {(f"names of {stem} {words}", stem.replace("vertebrae", "vertebra").rstrip("s")): moved}


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


def _of_suspect(
    cohort: Cohort, words: str, column: str, certain: bool, specimens: Sequence[str]
) -> Doubt:
    place = (file_of(cohort, _stem(cohort)), _line(cohort, specimens[0], cohort.joint_names[0]))
    whose = of_specimens(specimens, cohort.specimen_names)
    found = f"axes of joints that do not follow the line through their origins ({whose})"
    allowed = f"y axes along that line within {STRAY_DEG:g} deg"
    if certain:
        found = f"joints below those that they stand on ({whose})"
        allowed = "joints one above the other, as cohort.yaml lists them, along +y of their axes"
    return Doubt(Problem(*place, column, found, allowed, words), "postures", certain)


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


def doubtful_landmarks(cohort: Cohort) -> Found:
    """Landmarks that make a spine once two columns, a sign, sides or names are exchanged."""
    told = dict[Suspect, list[str]]()
    for specimen in cohort.specimen_names if cohort.landmarks is not None else ():
        points = _in_mm(landmarks(cohort, specimen))
        levels = {name: points[name] for name in cohort.vertebrae if name in points}
        found = suspect(levels) if all(map(is_level, levels)) else None
        if found is not None:
            told.setdefault(found, []).append(specimen)
    doubts = [_of_landmarks(cohort, found, names) for found, names in told.items()]
    return Found.of(doubts, [name for names in told.values() for name in names])


def _of_landmarks(cohort: Cohort, found: Suspect, specimens: Sequence[str]) -> Doubt:
    assert cohort.landmarks is not None
    row = int(np.flatnonzero(cohort.landmarks["specimen"] == specimens[0])[0])
    place = (file_of(cohort, "landmarks"), first_line(cohort, "landmarks", row), found.column)
    whose = of_specimens(specimens, cohort.specimen_names)
    shown = f"landmarks that are those of no spine ({whose})"
    allowed = "endplates and vertebrae above each other, right sides along +z, pedicles behind"
    return Doubt(Problem(*place, shown, allowed, found.words), "postures", certain=True)


def doubtful_shapes(cohort: Cohort, left_out: Container[str]) -> Found:
    """Vertebrae whose four landmarks are those of no vertebra, one line for each fault."""
    table = cohort.landmarks
    found: dict[tuple[str, str, bool], list[tuple[str, str]]] = defaultdict(list)
    for specimen in cohort.specimen_names if table is not None else ():
        if specimen not in left_out:
            for vertebra, points in _in_mm(landmarks(cohort, specimen)).items():
                if is_level(vertebra) and all(name in points for name in FRAME_LANDMARKS):
                    fault = _fault(points)
                    if fault is not None:
                        found[fault].append((specimen, vertebra))
    doubts = [_of_shape(cohort, *fault, places) for fault, places in found.items()]
    return Found.of(doubts, [specimen for places in found.values() for specimen, _ in places])


def _of_shape(
    cohort: Cohort, words: str, remedy: str, certain: bool, places: Sequence[tuple[str, str]]
) -> Doubt:
    table = cohort.landmarks
    assert table is not None
    specimen, vertebra = places[0]
    rows = np.flatnonzero((table["specimen"] == specimen) & (table["vertebra"] == vertebra))
    place = (file_of(cohort, "landmarks"), first_line(cohort, "landmarks", int(rows[0])), XYZ[0])
    shown = ", ".join(f"{v} of {s}" for s, v in places[:3]) + (", …" if places[3:] else "")
    allowed = "pedicle bases to the sides of the body and behind it, endplates above each other"
    return Doubt(Problem(*place, f"{words} ({shown})", allowed, remedy), "postures", certain)


def _in_mm(points: Mapping[str, Mapping[str, Array]]) -> dict[str, dict[str, Array]]:
    return {v: {name: p * MM_PER_M for name, p in one.items()} for v, one in points.items()}


def doubtful_sides(cohort: Cohort, left_out: Container[str]) -> Iterator[Doubt]:
    """Landmarks of a left and a right side that do not lie to the left and right of each other."""
    for specimen in cohort.specimen_names if cohort.landmarks is not None else ():
        if specimen in left_out:
            continue
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
