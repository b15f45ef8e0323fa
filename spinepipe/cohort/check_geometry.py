"""Can the geometry of a cohort be that of spines?

Has every joint of every specimen a pose? Are neighbours as far apart as in a spine (metres taken
for millimetres show here)? Can the bodies exist, and are all there that gravity needs?
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import isnan, sqrt

import numpy as np

from spinepipe.cohort.draft import Draft
from spinepipe.cohort.swapped_landmarks import Suspect, suspect
from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.frames import joint_pose
from spinepipe.problems import InputProblem
from spinepipe.units import MM_PER_M

SMALLEST_MM = 0.1

LARGEST_MM = 1000.0

Place = tuple[str, int | None, str | None]

XYZ = ("x_mm", "y_mm", "z_mm")

UPPER_FACE, LOWER_FACE = "inferior_endplate_centre", "superior_endplate_centre"


def check_geometry(draft: Draft) -> Iterator[InputProblem]:
    """Joints without a pose, landmarks that define no frame, and points that lie nowhere sane."""
    if {"landmarks", "joints"} <= draft.absent:
        if not any(form.places for stem, form in draft.forms.items() if stem not in draft.absent):
            found = "neither landmarks.csv nor joints.csv"
            allowed = "landmarks.csv, joints.csv or both"
            yield InputProblem(draft.name, None, None, found, allowed, "add one")
        return
    if not draft.vertebrae:
        return
    given = {cells for _, cells in draft.rows("joints", "specimen", "joint")}
    yield from _spacing(draft, "joints", "joint", XYZ, draft.joint_names, "the origins")
    unreadable = {"landmarks", "joints"} - draft.absent - set(draft.tables)
    if not unreadable:
        yield from landmark_problems(draft, given)


def landmark_problems(draft: Draft, given: set[tuple[str, str]]) -> Iterator[InputProblem]:
    """Problems of the joint frames that only landmarks can give.

    Parameters
    ----------
    given : (specimen, joint) whose pose is known from elsewhere.
    """
    points, lines = _points(draft)
    for specimen in draft.specimens:
        told = [
            (name, points[specimen, name]) for name in draft.vertebrae if (specimen, name) in points
        ]
        behind = suspect(dict(told))
        pairs = zip(draft.vertebrae[:-1], draft.vertebrae[1:], strict=True)
        for joint, (lower, upper) in zip(draft.joint_names, pairs, strict=True):
            if (specimen, joint) in given:
                continue
            if "landmarks" in draft.absent:
                found = f"no row of joint {joint} of specimen '{specimen}'"
                allowed = "a row for each joint of each specimen, or landmarks.csv"
                yield InputProblem(
                    draft.file("joints"), None, "joint", found, allowed, "add the row"
                )
            else:
                sides = (points.get((specimen, lower), {}), points.get((specimen, upper), {}))
                line = lines.get((specimen, upper)) or lines.get((specimen, lower))
                place = (draft.file("landmarks"), line, None)
                name = f"{joint} of specimen '{specimen}'"
                yield from _joint_problems(place, name, *sides, behind)


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
    place: Place,
    joint: str,
    lower: Mapping[str, Array],
    upper: Mapping[str, Array],
    behind: Suspect | None,
) -> Iterator[InputProblem]:
    if any(np.isnan(point).any() for side in (lower, upper) for point in side.values()):
        return  # a bad cell, reported there
    for side, face, which in ((upper, UPPER_FACE, "upper"), (lower, LOWER_FACE, "lower")):
        if face not in side:
            yield _no_pose(place, joint, f"the {which} vertebra has no {face}", behind)
            return
    apart = upper[UPPER_FACE] - lower[LOWER_FACE]
    wrong_unit = list(spacing_problem(place, apart, XYZ, f"the endplate centres at {joint}"))
    if wrong_unit:
        yield from wrong_unit
        return
    # the frame itself: whether there is one, and whether its axes point where ground's do
    in_metres = (
        {name: point / MM_PER_M for name, point in side.items()} for side in (lower, upper)
    )
    try:
        pose = joint_pose(*in_metres)
    except ValueError as error:
        yield _no_pose(place, joint, str(error))
        return
    if (np.diag(pose.rotation) <= 0.0).any():
        found = f"an axis of {joint} that points the wrong way"
        allowed = "x anterior, y superior, z right, each within 90 deg of ground's"
        remedy = "look for left and right, or superior and inferior, exchanged"
        if behind is not None:
            place, remedy = (*place[:2], behind.column), behind.words
        yield InputProblem(*place, found, allowed, remedy)


def _no_pose(place: Place, joint: str, reason: str, behind: Suspect | None = None) -> InputProblem:
    allowed = (
        f"{UPPER_FACE} above, {LOWER_FACE} below, and one of the two vertebrae with both endplate "
        "centres and both pedicle bases, or a row in joints.csv"
    )
    found = f"no frame for {joint}: {reason}"
    column = XYZ[0] if reason.startswith("the pedicle") else place[2]
    remedy = "add or correct the landmarks: one may be misplaced"
    if behind is not None:
        column, remedy = behind.column, behind.words
    return InputProblem(*place[:2], column, found, allowed, remedy)


def _spacing(
    draft: Draft, stem: str, key: str, columns: Sequence[str], names: Sequence[str], what: str
) -> Iterator[InputProblem]:
    """Points of neighbours among ``names`` (joints or vertebrae) too near or too far apart."""
    rows = draft.rows(stem, "specimen", key, *columns)
    points = {(cells[0], cells[1]): (line, np.array(cells[2:])) for line, cells in rows}
    for specimen in draft.specimens:
        for lower, upper in pairwise(names):
            if (specimen, lower) in points and (specimen, upper) in points:
                line, point = points[specimen, upper]
                apart = point - points[specimen, lower][1]
                place = (draft.file(stem), line, None)
                yield from spacing_problem(place, apart, columns, f"{what} of {lower} and {upper}")


COM = ("com_x_mm", "com_y_mm", "com_z_mm")
INERTIA = tuple(f"i{axes}_kg_m2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))

SYMMETRIC = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
"""Where in `INERTIA` the entries of the matrix stand."""

ROUNDING = 1e-3
"""Inertias in files are rounded to a few digits; a flat body sits exactly on the limit."""

KG_PER_T = 1e3

LIKELY_GYRATION_M = (0.005, 0.15)
"""Of a vertebra alone to a slice of a trunk."""

LIKELY_KG = (0.003, 5.0)

LARGEST_GYRATION_M = 1.0
"""No part of a trunk has its mass further than this from its centre."""


def check_bodies(draft: Draft) -> Iterator[InputProblem]:
    """Problems of ``bodies.csv`` beyond its cells and names."""
    yield from _inertias(draft)
    yield from _exchanged(draft)
    yield from _missing(draft)
    centres = (COM, draft.vertebrae, "the centres of mass")
    yield from _spacing(draft, "bodies", "vertebra", *centres)


def _exchanged(draft: Draft) -> Iterator[InputProblem]:
    """Masses that are none beside centres of mass that are masses."""
    rows = list(draft.rows("bodies", "mass_kg", "com_x_mm"))
    bad = [line for line, (mass, _) in rows if isnan(mass)]
    if bad and all(LIKELY_KG[0] <= x <= LIKELY_KG[1] for _, (_, x) in rows):
        found = "masses that are none, and com_x_mm that could be masses"
        remedy = "suspected: mass_kg and com_x_mm exchanged; exchange them back"
        place = (draft.file("bodies"), bad[0], "mass_kg")
        yield InputProblem(*place, found, "mass_kg in kg and com_x_mm in mm", remedy)


def _inertias(draft: Draft) -> Iterator[InputProblem]:
    """Inertias that no body has; all of a file are looked at together."""
    rows = list(draft.rows("bodies", "mass_kg", *INERTIA))
    six = np.array([cells[1:] for _, cells in rows]).reshape(len(rows), len(INERTIA))
    moments = np.zeros((len(rows), 3))
    whole = ~np.isnan(six).any(axis=1)
    moments[whole] = eigh(six[whole][:, SYMMETRIC])[0]
    file = draft.file("bodies")
    for index in np.flatnonzero(whole).tolist():
        line, (mass, *_) = rows[index]
        yield from _moment_problems(file, line, mass, moments[index])


def _moment_problems(file: str, line: int, mass: float, of_body: Array) -> Iterator[InputProblem]:
    """What is wrong with principal moments of inertia, kg m2, smallest first."""
    moments: list[float] = of_body.tolist()
    slack = ROUNDING * max(map(abs, moments))
    allowed = None
    if moments[0] < -slack:
        allowed = "no negative principal moment"
    elif moments[0] + moments[1] < moments[2] - slack:
        allowed = "no principal moment larger than the sum of the other two"
    if allowed is not None:
        found = f"principal moments {', '.join(f'{m:.4g}' for m in moments)} kg m2"
        remedy = "check signs, units (kg m2) and that the inertia is about the centre of mass"
        yield InputProblem(file, line, INERTIA[0], found, allowed, remedy)
    if moments[2] > mass * LARGEST_GYRATION_M**2:
        gyration = sqrt(moments[2] / mass)
        found = f"a radius of gyration of {gyration:.3g} m"
        allowed = f"at most {LARGEST_GYRATION_M:g} m"
        remedy = "give kg m2, not kg mm2 or kg cm2"
        if LIKELY_GYRATION_M[0] <= gyration / sqrt(KG_PER_T) <= LIKELY_GYRATION_M[1]:
            remedy = f"suspected: mass_kg in t and not kg, multiply it by 1000; or {remedy}"
        yield InputProblem(file, line, INERTIA[0], found, allowed, remedy)


def _missing(draft: Draft) -> Iterator[InputProblem]:
    """Bodies that gravity needs and the file lacks."""
    file = draft.file("bodies")
    if not draft.gravity:
        return
    if "bodies" in draft.absent:
        remedy = "add bodies.csv, or set gravity: false in cohort.yaml"
        yield InputProblem(
            file, None, None, "no such file", "bodies.csv when gravity is true", remedy
        )
    elif "bodies" in draft.tables:
        known = {cells for _, cells in draft.rows("bodies", "specimen", "vertebra")}
        for specimen in draft.specimens:
            for vertebra in draft.vertebrae[1:]:
                if (specimen, vertebra) not in known:
                    found = f"no body of specimen '{specimen}', vertebra '{vertebra}'"
                    allowed = "a body for every moving vertebra when gravity is true"
                    yield InputProblem(file, None, None, found, allowed, "add the row")


METRES_MM = (3.0, 150.0)
"""Neighbours that are so far apart once multiplied by 1000 were given in m."""


def spacing_problem(
    place: Place, apart: Array, columns: Sequence[str], what: str
) -> Iterator[InputProblem]:
    """The problem of two neighbouring points, if their distance says the unit is wrong.

    Parameters
    ----------
    place : file and line to report.
    apart : (3,) mm; NaN, from a cell that is bad and reported there, is no problem here.
    columns : x, y and z.
    what : which points.
    """
    distance = float(np.linalg.norm(apart))
    if distance < SMALLEST_MM or distance > LARGEST_MM:
        column = columns[int(np.argmax(np.abs(apart)))] if distance > LARGEST_MM else columns[0]
        remedy = "give millimetres, and look for a misplaced point"
        if METRES_MM[0] <= MM_PER_M * distance <= METRES_MM[1]:
            remedy = f"suspected: lengths in m and not mm; multiply {', '.join(columns)} by 1000"
        found = f"{what} {distance:.3g} mm apart"
        allowed = f"{SMALLEST_MM:g} mm to {LARGEST_MM:g} mm"
        yield InputProblem(*place[:2], column, found, allowed, remedy)
