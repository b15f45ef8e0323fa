"""Has every joint of every specimen a pose?"""

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort.check_spacing import spacing_problem
from spinepipe.cohort.draft import Draft
from spinepipe.frames import joint_pose
from spinepipe.problems import Problem

__all__ = ["check_geometry"]

Array = NDArray[np.float64]
Place = tuple[str, int | None, str | None]

MM_PER_M = 1000.0
XYZ = ("x_mm", "y_mm", "z_mm")
UPPER_FACE, LOWER_FACE = "inferior_endplate_centre", "superior_endplate_centre"


def check_geometry(draft: Draft) -> Iterator[Problem]:
    """Joints without a pose, landmarks that define no frame, and points that lie nowhere sane."""
    if {"landmarks", "joints"} <= draft.absent:
        found = "neither landmarks.csv nor joints.csv"
        allowed = "landmarks.csv, joints.csv or both"
        yield Problem(draft.name, None, None, found, allowed, "add one")
        return
    if not draft.vertebrae:
        return
    given = {cells for _, cells in draft.rows("joints", "specimen", "joint")}
    yield from _origin_spacing(draft)
    unreadable = {"landmarks", "joints"} - draft.absent - set(draft.tables)
    if not unreadable:
        yield from landmark_problems(draft, given)


def landmark_problems(draft: Draft, given: set[tuple[str, str]]) -> Iterator[Problem]:
    """Problems of the joint frames that only landmarks can give.

    Parameters
    ----------
    given : (specimen, joint) whose pose is known from elsewhere.
    """
    points, lines = _points(draft)
    for specimen in draft.specimens:
        pairs = zip(draft.vertebrae[:-1], draft.vertebrae[1:], strict=True)
        for joint, (lower, upper) in zip(draft.joint_names, pairs, strict=True):
            if (specimen, joint) not in given:
                sides = (points.get((specimen, lower), {}), points.get((specimen, upper), {}))
                line = lines.get((specimen, upper)) or lines.get((specimen, lower))
                place = (draft.file("landmarks"), line, None)
                yield from _joint_problems(place, f"{joint} of specimen '{specimen}'", *sides)


def _points(
    draft: Draft,
) -> tuple[dict[tuple[str, str], dict[str, Array]], dict[tuple[str, str], int]]:
    """Landmarks in mm of each (specimen, vertebra), and the line where its landmarks begin."""
    points: dict[tuple[str, str], dict[str, Array]] = {}
    lines: dict[tuple[str, str], int] = {}
    rows = draft.rows("landmarks", "specimen", "vertebra", "landmark", *XYZ)
    for line, (specimen, vertebra, landmark, *xyz) in rows:
        points.setdefault((specimen, vertebra), {})[landmark] = np.array(xyz)
        lines.setdefault((specimen, vertebra), line)
    return points, lines


def _joint_problems(
    place: Place, joint: str, lower: Mapping[str, Array], upper: Mapping[str, Array]
) -> Iterator[Problem]:
    if any(np.isnan(point).any() for side in (lower, upper) for point in side.values()):
        return  # a bad cell, reported there
    for side, face, which in ((upper, UPPER_FACE, "upper"), (lower, LOWER_FACE, "lower")):
        if face not in side:
            yield _no_pose(place, joint, f"the {which} vertebra has no {face}")
            return
    distance = float(np.linalg.norm(upper[UPPER_FACE] - lower[LOWER_FACE]))
    wrong_unit = list(spacing_problem(place, distance, f"the endplate centres at {joint}"))
    if wrong_unit:
        yield from wrong_unit
        return
    yield from _frame_problems(place, joint, lower, upper)


def _frame_problems(
    place: Place, joint: str, lower: Mapping[str, Array], upper: Mapping[str, Array]
) -> Iterator[Problem]:
    try:
        pose = joint_pose(_metres(lower), _metres(upper))
    except ValueError as error:
        yield _no_pose(place, joint, str(error))
        return
    if (np.diag(pose.rotation) <= 0.0).any():
        found = f"an axis of {joint} that points the wrong way"
        allowed = "x anterior, y superior, z right, each within 90 deg of ground's"
        remedy = "look for left and right, or superior and inferior, exchanged"
        yield Problem(*place, found, allowed, remedy)


def _metres(points: Mapping[str, Array]) -> dict[str, Array]:
    return {name: point / MM_PER_M for name, point in points.items()}


def _no_pose(place: Place, joint: str, reason: str) -> Problem:
    allowed = (
        f"{UPPER_FACE} above, {LOWER_FACE} below, and one of the two vertebrae with both endplate "
        "centres and both pedicle bases, or a row in joints.csv"
    )
    found = f"no frame for {joint}: {reason}"
    return Problem(*place, found, allowed, "add or correct the landmarks")


def _origin_spacing(draft: Draft) -> Iterator[Problem]:
    rows = draft.rows("joints", "specimen", "joint", *XYZ)
    origins = {(cells[0], cells[1]): (line, np.array(cells[2:])) for line, cells in rows}
    names = draft.joint_names
    for specimen in draft.specimens:
        for below, joint in pairwise(names):
            if (specimen, below) in origins and (specimen, joint) in origins:
                line, origin = origins[specimen, joint]
                distance = float(np.linalg.norm(origin - origins[specimen, below][1]))
                place = (draft.file("joints"), line, "x_mm")
                what = f"the origins of {below} and {joint}"
                yield from spacing_problem(place, distance, what)
