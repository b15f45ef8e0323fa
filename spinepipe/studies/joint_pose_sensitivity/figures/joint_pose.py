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
from spinepipe.report.glyphs import KEY, Quartiles, draw_bar, draw_density, draw_iqr, finite
from spinepipe.report.panels import PanelRows, explain, grid, head, label_rows, row_height, rows_of
from spinepipe.report.style import GREY, OURS, THEIRS, note, saying
from spinepipe.report.words import AXIS, count, fixed, percent, unit
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import MM_PER_M, ROTATIONS, TRANSLATIONS

_ORIGIN = dict(zip(("x_mm", "y_mm", "z_mm"), TRANSLATIONS, strict=True))
_ANGLES = {f"{name}_deg": name for name in ROTATIONS}
_NAMES = {**_ORIGIN, **_ANGLES}
COLUMNS = tuple(_NAMES)


def joint_pose_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Origin (three panels) and orientation (three) of every joint, less the nominal ones."""
    poses = tables["poses"]
    sampled = poses[poses["status"] == Status.CONVERGED.value]
    total = len(poses[["specimen", "pose"]].drop_duplicates())
    if sampled.empty:
        return saying(f"None of {count(total, 'landmark set')} defines joint frames.")
    nominal = _nominal(cohort)
    shifted = _less_nominal(sampled, nominal)
    rows = rows_of(shifted, cohort.specimen_names, cohort.joint_names)
    axes, figure = grid(len(COLUMNS), rows, row_height(rows, 17.0))
    for index, (column, axis) in enumerate(zip(COLUMNS, axes, strict=True)):
        kind = "origin" if column in _ORIGIN else "orientation"
        head(axis, index, f"{AXIS[_NAMES[column]]} {kind}")
        _draw(column, axis, rows, nominal, cohort)
    for panels in (axes[:3], axes[3:]):  # the same limits left and right of the nominal value
        reach = max(abs(end) for axis in panels for end in axis.get_xlim())
        for axis in panels:
            axis.set_xlim(-reach, reach)
    failed = total - len(sampled[["specimen", "pose"]].drop_duplicates())
    bars = {OURS: "sampled landmarks"}
    paper = GOULD_2024A.beside(cohort.name)
    if paper:
        bars[THEIRS] = f"{paper[0]}, Tables 7 and 8, complete set (IQR drawn around the median)"
    explain(figure, bars, _words(total, failed, rows))
    return figure


def _nominal(cohort: Cohort) -> pd.DataFrame:
    """Joint frames of the cohort itself, mm and deg, by specimen and joint."""
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


def _draw(column: str, axis: Axes, rows: PanelRows, nominal: pd.DataFrame, cohort: Cohort) -> None:
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    for y, frame in enumerate(rows.frames):
        values = finite(frame[column])
        draw_density(axis, values, y + 0.08, 0.36, OURS)
        found = draw_bar(axis, values, y, OURS)
        here = nominal[nominal["joint"] == frame["joint"].iloc[0]]
        here = here[here["specimen"].isin(frame["specimen"].unique())]
        center = float(here[column].iloc[0])
        paper = _paper(cohort, frame["joint"].iloc[0], column)
        if paper is not None:
            less = Quartiles(paper.low - center, paper.median - center, paper.high - center, 0)
            draw_iqr(axis, less, y - 0.22, THEIRS)
        if rows.with_numbers:  # median and width of the middle half, ours left, the paper's right
            note(axis, 0.02, y + 0.55, _median(center + found.median, found), OURS)
            if paper is not None:
                note(axis, 0.98, y + 0.55, _median(paper.median, paper), THEIRS, ha="right")
    label_rows(axis, rows, below=0.4, above=0.7)
    axis.set_xlabel(f"sampled less nominal ({unit(_NAMES[column])})")


def _median(median: float, found: Quartiles) -> str:
    return f"{fixed(median)} (IQR {fixed(found.iqr)})"


def _paper(cohort: Cohort, joint: str, column: str) -> Quartiles | None:
    """The paper's median and IQR of a joint; it prints no quartiles, the IQR is put around it."""
    found = GOULD_2024A.beside(cohort.name)
    if found is None:
        return None
    table = "joint_origin" if column in _ORIGIN else "joint_orientation"
    rows: Mapping[str, Any] = found[1][table]["complete"]
    name = f"{_ORIGIN[column]}_mm" if column in _ORIGIN else column
    if joint not in rows:
        return None
    median, iqr = rows[joint]["median"][name], rows[joint]["iqr"][name]
    return Quartiles(median - iqr / 2.0, median, median + iqr / 2.0, 0)


def _words(total: int, failed: int, rows: PanelRows) -> str:
    share = f"{percent(failed, total)} define no frame" if failed else "all define frames"
    numbers = "numbers: median and IQR in ground axes" if rows.with_numbers else ""
    zero = "line at 0: the cohort's own frames"
    parts = (f"{count(total, 'landmark set')}, {share}", rows.note, KEY, numbers, zero)
    return "; ".join(part for part in parts if part) + "."
