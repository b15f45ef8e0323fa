"""Joints that face or lie as in no spine: upside down, out of order, columns or signs exchanged.

The axes of joint frames and the line through their origins tell of the same curve. Where they do
not agree, and do once columns are exchanged, a sign is turned or radians are taken for degrees,
that is suspected.
"""

from collections import defaultdict
from collections.abc import Container, Iterator, Mapping
from dataclasses import replace

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.specimen import landmarks
from spinepipe.cohort.swapped_landmarks import (
    ACROSS,
    BEHIND_MM,
    XYZ,
    column_mistakes,
    exchange,
)
from spinepipe.cohort.swapped_landmarks import suspect as suspect_landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, rotation_zxy, zxy_angles
from spinepipe.plausibility.score import BETTER, usual
from spinepipe.plausibility.warnings.lengths import stem_of_joints
from spinepipe.plausibility.warnings.levels import (
    EXTENSION_DEG,
    NeutralPose,
    extension_range_deg,
    is_level,
)
from spinepipe.plausibility.warnings.warning import (
    PlausibilityWarning,
    TableCell,
    WarningGroup,
    first_row,
    warn,
)
from spinepipe.units import MM_PER_M

AS_GOOD_DEG, AS_GOOD_SDS = 2.0, 0.5
"""Two suspects that bring them as near together, and make spines as likely, are both named."""

LEAST_SINE = 0.5
"""Pedicle line and endplate line are square in a vertebra; here 30 deg."""

ANGLES = ("extension_deg", "right_bending_deg", "left_rotation_deg")

_Told = tuple[str, str, bool]
"""Remedy, column, and whether a joint lies below the one that it should be above."""


def postures(cohort: Cohort, poses: list[NeutralPose]) -> WarningGroup:
    """Axes and order of joints, where vertebrae are levels of the spine."""
    told: dict[_Told, list[str]] = defaultdict(list)
    single: dict[str, list[PlausibilityWarning]] = {}
    for pose in poses:
        if not all(map(is_level, pose.vertebrae)):
            continue
        below = list(_below(cohort, pose))
        suspected = _out_of_order(cohort, pose, below[0]) if below else _suspect(cohort, pose)
        if suspected is not None:
            told[*suspected, bool(below)].append(pose.specimen)
        elif odd := list(_axes(cohort, pose)):
            single[pose.specimen] = odd
    found = [one for warnings in single.values() for one in warnings]
    for (remedy, column, upset), names in told.items():
        place = _place(cohort, names[0], cohort.joint_names[0], column)
        name = "joint_below" if upset else "axes_off_line"
        found.append(warn(cohort, name, place, remedy=remedy, whose=names))
    return WarningGroup.of(found, [*single, *(name for names in told.values() for name in names)])


def _place(cohort: Cohort, specimen: str, joint: str, column: str | None) -> TableCell:
    """The first row of a joint or, of landmarks, of its upper vertebra."""
    stem = stem_of_joints(cohort)
    upper = cohort.vertebrae[cohort.joint_names.index(joint) + 1]
    named = {"joint": joint} if stem == "joints" else {"vertebra": upper}
    return TableCell(stem, first_row(cohort, stem, specimen=specimen, **named), column)


def _upward(pose: NeutralPose) -> tuple[Array, Array]:
    """(J - 1, 3) from joint to joint, and unit vectors along the mean of their y axes."""
    up = pose.rotations[1:, :, 1] + pose.rotations[:-1, :, 1]
    size = np.linalg.norm(up, axis=1, keepdims=True)
    return np.diff(pose.origins, axis=0), up / np.maximum(size, 1e-12)


def _below(cohort: Cohort, pose: NeutralPose) -> Iterator[str]:
    """Joints below the one that they should be above."""
    lines, up = _upward(pose)
    low = np.sum(lines * up, axis=1) <= 0.0
    yield from (cohort.joint_names[index + 1] for index in np.flatnonzero(low))


def _stray_deg(pose: NeutralPose) -> float:
    """Root mean square angle between the line from joint to joint and the mean of their y axes."""
    if len(pose.origins) < 2:
        return 0.0
    lines, up = _upward(pose)
    cosines = np.sum(lines * up, axis=1) / np.maximum(np.linalg.norm(lines, axis=1), 1e-12)
    return float(np.rad2deg(np.sqrt(np.mean(np.arccos(np.clip(cosines, -1.0, 1.0)) ** 2))))


def _out_of_order(cohort: Cohort, pose: NeutralPose, first: str) -> tuple[str, str]:
    """What makes a joint lie below the one that it should be above, and the column."""
    best = _best(_tried(pose) | _other_names(cohort, pose), _stray_deg(pose))
    under = cohort.joint_names[cohort.joint_names.index(first) - 1]
    words = (
        f"look at {first}, which lies below {under}: joints or vertebrae exchanged, or misplaced"
    )
    return best or (words, XYZ[1])


def _suspect(cohort: Cohort, pose: NeutralPose) -> tuple[str, str] | None:
    """What makes line and axes of a specimen disagree, and its column; None where they agree."""
    here = _stray_deg(pose)
    largest = float(np.abs(np.rad2deg(zxy_angles(pose.rotations))).max())
    in_radians = largest > 1e-3 and not usual("orientation").holds(largest)
    if cohort.joints is not None and len(pose.origins) > 1 and in_radians:
        return "suspected: orientations in radians and not degrees; multiply by 57.3", ANGLES[0]
    if usual("axes_off_line").holds(here):
        return None
    found = _best(_tried(pose), here) if len(pose.origins) > 2 else None
    found = found or _apart(cohort, pose)
    if found is None and not usual("axes_askew").holds(here):
        return "look for exchanged columns, and whether axes are those of ground", XYZ[0]
    return found


_Tried = dict[tuple[str, str], NeutralPose]
"""Words and column of a mistake, and how joints would stand without it."""


def _best(tried: _Tried, here_deg: float) -> tuple[str, str] | None:
    """The mistake without which line and axes agree best; of two as good both are named.

    Of those as good that one whose spine then stands more as spines do at their levels.
    """
    stray = {one: _stray_deg(pose) for one, pose in tried.items() if not _upset(pose)}
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
    lines, up = _upward(pose)
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
    lines, up = _upward(pose)
    aside = lines - np.sum(lines * up, axis=1)[:, None] * up
    sizes = np.linalg.norm(aside, axis=1)
    gap = int(np.argmax(sizes))
    near = max(range(len(sizes)), key=lambda k: sizes[k] if abs(k - gap) == 1 else -1.0)
    whole = aside[gap] + aside[near]  # a joint halfway between two vertebrae has half of each
    most = usual("joint_aside").high
    if np.linalg.norm(whole) < most or np.any(np.delete(sizes, [gap, near]) > most / 3.0):
        return None
    above = cohort.joint_names[max(gap, near if sizes[near] > most / 3.0 else 0) + 1]
    words = (
        f"suspected: {above} of {pose.specimen} and all above it misplaced by "
        f"{np.linalg.norm(whole):.0f} mm, as of a scan in two pieces"
    )
    return words, XYZ[int(np.argmax(np.abs(whole)))]


def _tried(pose: NeutralPose) -> _Tried:
    """How joints would stand without each mistake of columns."""
    angles = zxy_angles(pose.rotations)
    found = {}
    for words, column, undone in column_mistakes(XYZ):
        found[words, column] = replace(pose, origins=undone(pose.origins))
    for words, column, undone in column_mistakes(ANGLES, ways=("", "")):
        turned = np.array([rotation_zxy(*one) for one in undone(angles)])
        found[words, column] = replace(pose, rotations=turned)
    return found


def _other_names(cohort: Cohort, pose: NeutralPose) -> _Tried:
    """The same joints in the order in which they lie, where one exchange of names makes it."""
    order = np.argsort(pose.origins[:, 1])
    words = exchange(cohort.joint_names, [cohort.joint_names[k] for k in order])
    if words is None:
        return {}
    names, column = ("vertebrae", "vertebra") if cohort.joints is None else ("joints", "joint")
    moved = replace(pose, origins=pose.origins[order], rotations=pose.rotations[order])
    return {(f"names of {names} {words}", column): moved}


def _axes(cohort: Cohort, pose: NeutralPose) -> Iterator[PlausibilityWarning]:
    """Joints that lean or turn as those of no spine, by level."""
    angles = np.rad2deg(zxy_angles(pose.rotations))
    lean, turn = usual("joint_lean"), usual("joint_turn")
    for index, (joint, own) in enumerate(zip(cohort.joint_names, angles, strict=True)):
        extension = extension_range_deg(pose.vertebrae[index]) or (-np.inf, np.inf)
        ranges = (extension, (lean.low, lean.high), (turn.low, turn.high))
        for name, angle, (low, high) in zip(ANGLES, own, ranges, strict=True):
            if not low <= angle <= high:
                column = name if cohort.joints is not None else None
                place = _place(cohort, pose.specimen, joint, column)
                yield warn(
                    cohort,
                    "joint_turned",
                    place,
                    whose=[pose.specimen],
                    joint=joint,
                    angle=angle,
                    name=name,
                    low=low,
                    high=high,
                )


# --- landmarks ------------------------------------------------------------------------------------


def exchanged_landmarks(cohort: Cohort) -> WarningGroup:
    """Landmarks that make a spine once two columns, a sign, sides or names are exchanged."""
    told: dict[tuple[str, str], list[str]] = defaultdict(list)
    for specimen in cohort.specimen_names if cohort.landmarks is not None else ():
        points = _in_mm(landmarks(cohort, specimen))
        levels = {name: points[name] for name in cohort.vertebrae if name in points}
        found = suspect_landmarks(levels) if all(map(is_level, levels)) else None
        if found is not None:
            told[found.words, found.column].append(specimen)
    warnings = [
        warn(
            cohort,
            "landmarks_of_no_spine",
            TableCell("landmarks", first_row(cohort, "landmarks", specimen=names[0]), column),
            remedy=remedy,
            whose=names,
        )
        for (remedy, column), names in told.items()
    ]
    return WarningGroup.of(warnings, [name for names in told.values() for name in names])


def shapes(cohort: Cohort, left_out: Container[str]) -> WarningGroup:
    """Vertebrae whose four landmarks are those of no vertebra, one line for each fault."""
    found: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for specimen in cohort.specimen_names if cohort.landmarks is not None else ():
        if specimen not in left_out:
            for vertebra, points in _in_mm(landmarks(cohort, specimen)).items():
                whole = is_level(vertebra) and all(name in points for name in FRAME_LANDMARKS)
                if whole and (fault := _fault(points)) is not None:
                    found[fault].append((specimen, vertebra))
    warnings = []
    for fault, places in found.items():
        specimen, vertebra = places[0]
        row = first_row(cohort, "landmarks", specimen=specimen, vertebra=vertebra)
        shown = ", ".join(f"{v} of {s}" for s, v in places[:3]) + (", …" if places[3:] else "")
        warnings.append(warn(cohort, fault, TableCell("landmarks", row, XYZ[0]), where=shown))
    return WarningGroup.of(
        warnings, [specimen for places in found.values() for specimen, _ in places]
    )


def _fault(points: Mapping[str, Array]) -> str | None:
    """The warning of what is wrong with the landmarks (mm) of a vertebra."""
    top, bottom, left, right = (points[name] for name in FRAME_LANDMARKS)
    across, up = right - left, top - bottom
    sizes = float(np.linalg.norm(across)), float(np.linalg.norm(up))
    forward = np.cross(up, across) / max(sizes[0] * sizes[1], 1e-12)
    sine = float(np.linalg.norm(forward))
    if sine < LEAST_SINE:
        return "landmarks_on_a_line"
    behind = (left + right) / 2.0 - (top + bottom) / 2.0
    if float(behind @ forward) / sine > BEHIND_MM:
        return "pedicles_in_front"
    return None if usual("pedicles_apart").holds(sizes[0]) else "pedicles_apart"


def _in_mm(points: Mapping[str, Mapping[str, Array]]) -> dict[str, dict[str, Array]]:
    return {v: {name: p * MM_PER_M for name, p in one.items()} for v, one in points.items()}


def sides(cohort: Cohort, left_out: Container[str]) -> Iterator[PlausibilityWarning]:
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
        to_the_right = length > 0.0 and float(np.sum(across, axis=0)[2]) >= ACROSS * length
        if length > 0.0 and not to_the_right and specimen not in left_out:
            row = first_row(cohort, "landmarks", specimen=specimen)
            yield warn(
                cohort, "sides_exchanged", TableCell("landmarks", row, XYZ[2]), whose=[specimen]
            )
