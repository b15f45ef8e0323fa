"""Figure: how far the sampled landmarks move each joint's origin and turn its axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.frames import zxy_angles
from spinepipe.report.layout import grid, label_rows, row_height
from spinepipe.report.published import paper_of
from spinepipe.report.rows import Rows, rows_of
from spinepipe.report.spread import KEY, Quartiles, draw_bar, draw_density, draw_iqr, finite
from spinepipe.report.style import BLUE, GREY, VERMILLION, note, saying
from spinepipe.report.words import AXIS, count, fixed, percent
from spinepipe.statics.status import Status
from spinepipe.units import MM_PER_M, ROTATIONS, TRANSLATIONS

_ORIGIN = dict(zip(("x_mm", "y_mm", "z_mm"), TRANSLATIONS, strict=True))
_ANGLES = {f"{name}_deg": name for name in ROTATIONS}
COLUMNS = (*_ORIGIN, *_ANGLES)


def joint_pose_figure(cohort: Cohort, poses: pd.DataFrame) -> Figure:
    """Origin (three panels) and orientation (three) of every joint, less the nominal ones."""
    sampled = poses[poses["status"] == Status.CONVERGED.value]
    total = len(poses[["specimen", "pose"]].drop_duplicates())
    if sampled.empty:
        return saying(f"None of {count(total, 'landmark set')} defines joint frames.")
    nominal = _nominal(cohort)
    shifted = _less_nominal(sampled, nominal)
    rows = rows_of(shifted, cohort.specimen_names, cohort.joint_names)
    axes, figure = grid(len(COLUMNS), rows, row_height(rows, 17.0))
    for column, axis in zip(COLUMNS, axes, strict=True):
        _draw(column, axis, rows, nominal, cohort)
    failed = total - len(sampled[["specimen", "pose"]].drop_duplicates())
    figure.supxlabel(_key(cohort, total, failed, rows), fontsize=6.5, color=GREY)
    return figure


def _nominal(cohort: Cohort) -> pd.DataFrame:
    """Joint frames from the landmarks as palpated, mm and deg, by specimen and joint."""
    rows = []
    for specimen in cohort.specimen_names:
        frames = joint_frames(cohort, specimen)
        for joint, frame in zip(cohort.joint_names, frames, strict=True):
            numbers = [*(frame.origin * MM_PER_M), *np.rad2deg(zxy_angles(frame.rotation))]
            rows.append((specimen, joint, *numbers))
    return pd.DataFrame(rows, columns=["specimen", "joint", *COLUMNS])


def _less_nominal(sampled: pd.DataFrame, nominal: pd.DataFrame) -> pd.DataFrame:
    """Sampled less nominal, angles between -180 and 180 degrees."""
    keys = ["specimen", "joint"]
    both = sampled.merge(nominal, on=keys, suffixes=("", "_nominal"))
    for column in COLUMNS:
        difference = both[column] - both[f"{column}_nominal"]
        if column in _ANGLES:
            difference = (difference + 180.0) % 360.0 - 180.0
        both[column] = difference
    return both


def _draw(column: str, axis: Axes, rows: Rows, nominal: pd.DataFrame, cohort: Cohort) -> None:
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    for y, frame in enumerate(rows.frames):
        values = finite(frame[column])
        draw_density(axis, values, y + 0.08, 0.36, BLUE)
        found = draw_bar(axis, values, y, BLUE)
        here = nominal[nominal["joint"] == frame["joint"].iloc[0]]
        here = here[here["specimen"].isin(frame["specimen"].unique())]
        center = float(here[column].iloc[0])
        paper = _paper(cohort, frame["joint"].iloc[0], column)
        if paper is not None:
            less = Quartiles(paper.low - center, paper.median - center, paper.high - center, 0)
            draw_iqr(axis, less, y - 0.22, VERMILLION)
        if rows.with_numbers:
            _write(axis, y, found, center, paper)
    label_rows(axis, rows, below=0.48, above=0.68)
    kind, unit = ("origin", "mm") if column in _ORIGIN else ("orientation", "°")
    axis.set_title(f"{AXIS[_ORIGIN.get(column) or _ANGLES[column]]} {kind} ({unit})")
    axis.set_xlabel(f"sampled less nominal ({unit})")


def _write(
    axis: Axes, y: int, found: Quartiles, center: float, paper: Quartiles | None
) -> None:
    """Median and width of the middle half, ours above and the paper's below."""
    ours = f"{fixed(center + found.median)} (IQR {fixed(found.iqr)})"
    note(axis, 0.02, y + 0.54, ours, BLUE)
    if paper is not None:
        theirs = f"{fixed(paper.median)} (IQR {fixed(paper.iqr)})"
        note(axis, 0.02, y - 0.36, theirs, VERMILLION)


def _paper(cohort: Cohort, joint: str, column: str) -> Quartiles | None:
    """The paper's median and IQR of a joint; it prints no quartiles, the IQR is put around it."""
    found = paper_of(cohort.name)
    if found is None:
        return None
    table = "joint_origin" if column in _ORIGIN else "joint_orientation"
    rows: Mapping[str, Any] = found[1][table]["complete"]
    name = f"{_ORIGIN[column]}_mm" if column in _ORIGIN else column
    if joint not in rows:
        return None
    median, iqr = rows[joint]["median"][name], rows[joint]["iqr"][name]
    return Quartiles(median - iqr / 2.0, median, median + iqr / 2.0, 0)


def _key(cohort: Cohort, total: int, failed: int, rows: Rows) -> str:
    share = f"{percent(failed, total)} define no frame" if failed else "all define frames"
    parts = [f"{count(total, 'landmark set')}, {share}", rows.note, KEY]
    first = "; ".join(part for part in parts if part)
    numbers = "numbers: median and IQR in ground axes; line at 0: landmarks as palpated"
    paper = paper_of(cohort.name)
    if paper:
        tables = "Tables 7 and 8, complete set, IQR drawn around the median"
        numbers += f"; red: {paper[0]}, {tables}"
    return f"{first}\n{numbers}" if rows.with_numbers else first
