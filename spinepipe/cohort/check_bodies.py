"""Can the bodies exist, and are all there that gravity needs?"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort.check_spacing import spacing_problem
from spinepipe.cohort.draft import Draft
from spinepipe.problems import Problem

__all__ = ["check_bodies"]

INERTIA = tuple(f"i{axes}_kg_m2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))

ROUNDING = 1e-3
"""Inertias in files are rounded to a few digits; a flat body sits exactly on the limit."""

LARGEST_GYRATION_M = 1.0
"""No part of a trunk has its mass further than this from its centre."""


def check_bodies(draft: Draft) -> Iterator[Problem]:
    """Problems of ``bodies.csv`` beyond its cells and names."""
    for line, (mass, *inertia) in draft.rows("bodies", "mass_kg", *INERTIA):
        yield from _inertia_problems(draft.file("bodies"), line, mass, np.array(inertia))
    yield from _missing(draft)
    yield from _spacing(draft)


def _inertia_problems(
    file: str, line: int, mass: float, six: NDArray[np.float64]
) -> Iterator[Problem]:
    empty = np.isnan(six)
    if empty.all():
        return
    if empty.any():
        column = INERTIA[int(np.argmax(empty))]
        remedy = "fill the row up, with 0 where a product is zero, or empty all six"
        yield Problem(file, line, column, "an incomplete inertia", "all six or none", remedy)
        return
    xx, yy, zz, xy, xz, yz = six
    moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    slack = ROUNDING * float(np.abs(moments).max())
    found = f"principal moments {', '.join(f'{m:.4g}' for m in moments)} kg m2"
    remedy = "check signs, units (kg m2) and that the inertia is about the centre of mass"
    if moments[0] < -slack:
        yield Problem(file, line, INERTIA[0], found, "no negative principal moment", remedy)
    elif moments[0] + moments[1] < moments[2] - slack:
        allowed = "no principal moment larger than the sum of the other two"
        yield Problem(file, line, INERTIA[0], found, allowed, remedy)
    if moments[2] > mass * LARGEST_GYRATION_M**2:
        gyration = np.sqrt(moments[2] / mass)
        found = f"a radius of gyration of {gyration:.3g} m"
        allowed = f"at most {LARGEST_GYRATION_M:g} m"
        yield Problem(file, line, INERTIA[0], found, allowed, "give kg m2, not kg mm2 or kg cm2")


def _missing(draft: Draft) -> Iterator[Problem]:
    """Bodies that gravity needs and the file lacks."""
    file = draft.file("bodies")
    if not draft.gravity:
        return
    if "bodies" in draft.absent:
        remedy = "add bodies.csv, or set gravity: false in cohort.yaml"
        yield Problem(file, None, None, "no such file", "bodies.csv when gravity is true", remedy)
    elif "bodies" in draft.tables:
        known = {cells for _, cells in draft.rows("bodies", "specimen", "vertebra")}
        for specimen in draft.specimens:
            for vertebra in draft.vertebrae[1:]:
                if (specimen, vertebra) not in known:
                    found = f"no body of specimen '{specimen}', vertebra '{vertebra}'"
                    allowed = "a body for every moving vertebra when gravity is true"
                    yield Problem(file, None, None, found, allowed, "add the row")


def _spacing(draft: Draft) -> Iterator[Problem]:
    columns = ("specimen", "vertebra", "com_x_mm", "com_y_mm", "com_z_mm")
    rows = draft.rows("bodies", *columns)
    centres = {(cells[0], cells[1]): (line, np.array(cells[2:])) for line, cells in rows}
    for specimen in draft.specimens:
        for lower, upper in zip(draft.vertebrae[:-1], draft.vertebrae[1:], strict=True):
            if (specimen, lower) in centres and (specimen, upper) in centres:
                line, centre = centres[specimen, upper]
                distance = float(np.linalg.norm(centre - centres[specimen, lower][1]))
                what = f"the centres of mass of {lower} and {upper}"
                place = (draft.file("bodies"), line, "com_x_mm")
                yield from spacing_problem(place, distance, what)
