"""One specimen as text: frames, bodies, loads and measured motion, mm and deg."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import followers
from spinepipe.frames import zxy_angles
from spinepipe.report.specimen import SpecimenView
from spinepipe.units import COORDINATE_COLUMNS, MM_PER_M, ROTATIONS, from_si

Cells = Sequence[object]


def describe(cohort: Cohort, view: SpecimenView) -> str:
    """All that the cohort says of the specimen alone, as a report for the terminal."""
    parts = [
        _heading(cohort, view),
        _section("joint frames in ground, neutral pose", _frames(cohort, view)),
        _section("bodies", _bodies(view)),
        _section("loads in ground axes, point at the neutral pose", _loads(cohort, view)),
        _section("measured motion", _motion(cohort, view)),
        *(
            _section(name, _further(rows, view))
            for name, rows in cohort.further.items()
            if "specimen" in rows
        ),
    ]
    return "\n\n".join(parts)


def _heading(cohort: Cohort, view: SpecimenView) -> str:
    names = cohort.specimen_names
    others = f" ({names.index(view.specimen) + 1} of {len(names)})" if len(names) > 1 else ""
    row = cohort.specimens[cohort.specimens["specimen"] == view.specimen].iloc[0]
    facts = [f"{name} {_cell(x)}" for name, x in row.items() if name != "specimen" and _known(x)]
    lines = [
        f"cohort     {cohort.name}: {cohort.title}",
        f"specimen   {view.specimen}{others}" + (f": {', '.join(facts)}" if facts else ""),
        f"vertebrae  {', '.join(cohort.vertebrae)} (the first is fixed)",
        f"gravity    {'9.81 m/s2 downward' if cohort.gravity else 'off'}",
    ]
    told = [f"{force:g} N in {test}" for test, force in followers(cohort, view.specimen).items()]
    return "\n".join([*lines, *([f"follower   {', '.join(told)}"] if told else [])])


def _section(title: str, rows: Iterator[Cells]) -> str:
    table = list(rows)
    if len(table) < 2:
        return f"{title}: none"
    return f"{title}\n{_table(table)}"


def _frames(cohort: Cohort, view: SpecimenView) -> Iterator[Cells]:
    yield ("joint", "x_mm", "y_mm", "z_mm", *(f"{name}_deg" for name in ROTATIONS))
    joints = cohort.joint_names if view.frames else ()
    for joint, frame in zip(joints, view.frames, strict=True):
        angles = np.rad2deg(zxy_angles(frame.rotation))
        yield (joint, *(frame.origin * MM_PER_M), *angles)


def _bodies(view: SpecimenView) -> Iterator[Cells]:
    yield ("vertebra", "mass_kg", "com_x_mm", "com_y_mm", "com_z_mm", "ixx", "iyy", "izz_kg_m2")
    for body in view.bodies:
        inertia = [f"{value:.3g}" for value in np.diag(body.inertia)]
        yield (body.name, body.mass, *(body.com * MM_PER_M), *inertia)


def _loads(cohort: Cohort, view: SpecimenView) -> Iterator[Cells]:
    yield (
        *("test", "cycle", "step", "vertebra", "fx_n", "fy_n", "fz_n"),
        *("mx_nm", "my_nm", "mz_nm", "px_mm", "py_mm", "pz_mm"),
    )
    for case in view.cases:
        for step in case.steps:
            for wrench in step.wrenches:
                name = cohort.vertebrae[wrench.body + 1]
                numbers = (*wrench.force, *wrench.moment, *(wrench.point * MM_PER_M))
                yield (case.test, case.cycle, step.step, name, *numbers)


def _motion(cohort: Cohort, view: SpecimenView) -> Iterator[Cells]:
    yield ("test", "cycle", "step", "joint", *COORDINATE_COLUMNS)
    for one in view.tested:
        case = one.case
        for step, measured in zip(case.steps, from_si(one.measured), strict=True):
            for joint, row in zip(cohort.joint_names, measured, strict=True):
                if np.isfinite(row).any():
                    yield (case.test, case.cycle, step.step, joint, *row)


def _further(rows: pd.DataFrame, view: SpecimenView) -> Iterator[Cells]:
    """A file of a kind of its own, without its empty columns."""
    own = rows[rows["specimen"] == view.specimen].drop(columns="specimen").dropna(axis=1, how="all")
    yield tuple(own.columns)
    yield from own.itertuples(index=False, name=None)


def _table(rows: Sequence[Cells]) -> str:
    """Columns aligned: text to the left, numbers to the right."""
    cells = [[_cell(value) for value in row] for row in rows]
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))]
    left = [isinstance(value, str) and not _is_number(value) for value in rows[1]]
    lines = [
        "  ".join(
            cell.ljust(width) if to_left else cell.rjust(width)
            for cell, width, to_left in zip(row, widths, left, strict=True)
        )
        for row in cells
    ]
    return "\n".join(f"  {line}".rstrip() for line in lines)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _cell(value: object) -> str:
    """Text of a cell; a dash where nothing was measured."""
    if isinstance(value, float):
        text = f"{value:.3f}".rstrip("0").rstrip(".")
        return "-" if np.isnan(value) else "0" if text == "-0" else text
    return str(value)


def _known(value: object) -> bool:
    return not (value is None or value == "" or (isinstance(value, float) and np.isnan(value)))
