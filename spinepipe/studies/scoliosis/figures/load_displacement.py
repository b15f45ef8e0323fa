"""Figure: moment over lateral rotation of every segment of one patient, with the laws' two ends."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.panels import explain_marks, side_by_side
from spinepipe.report.style import BLACK, GREY, SMALL_PT, blank, saying
from spinepipe.report.words import short
from spinepipe.studies.scoliosis.errors import held_out_error
from spinepipe.studies.scoliosis.figures.film_overlay import chosen
from spinepipe.studies.scoliosis.figures.line_styles import STYLES, axis_lines, key_of_lines
from spinepipe.studies.scoliosis.films import LEFT, RIGHT
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import EndRotations
from spinepipe.studies.scoliosis.words import in_order
from spinepipe.units import DEG_PER_RAD

ACROSS = 5
POINTS = 201

_PANEL_MM, _AROUND_MM, _KEY_MM = 30.0, 10.0, 17.0
_ENDS = ["lower_end_deg", "upper_end_deg"]
_MARKS = {LEFT: "<", RIGHT: ">"}
_LARGEST = 1.25
"""Axes reach this far beyond the largest moment on a bending film."""


def load_displacement_figure(
    study: Scoliosis, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A panel for each segment, the uppermost first; the patient of the median error."""
    laws = tables["laws"]
    ended = laws[laws[_ENDS].notna().all(axis=1)]
    if ended.empty:
        return saying("No law can be shown: no model of this study has laws that end.")
    # the patient whose error is in the middle; the first one where no model has a pose
    names, positions = ended["specimen"].unique(), tables["positions"]
    errors = held_out_error(positions[positions["specimen"].isin(names)])
    patient = str(names[0]) if errors.empty else chosen(errors, (0.5,))[0]
    own = ended[ended["specimen"] == patient]
    joints = [name for name in reversed(cohort.joint_names) if (own["joint"] == name).any()]
    pairs = _measured(tables["displacements"], patient)
    reach = _reach(own, pairs)
    down = -(-len(joints) // ACROSS)
    figure = blank(down * _PANEL_MM + _AROUND_MM + _KEY_MM)
    axes = side_by_side(figure, len(joints), ACROSS, sharex=True, sharey=True)
    for axis, joint in zip(axes, joints, strict=True):
        rows = own[own["joint"] == joint]
        axis.set_title(joint)
        _laws(axis, rows, reach)
        for position, mark in _MARKS.items():
            axis.plot([pairs[position].get(joint, np.nan)], [0.0], mark, color=BLACK, ms=3.5, mew=0)
        words = ["against a bend"] if rows["opposite"].any() else []
        words += ["held at a bound"] if rows["constrained"].any() else []
        axis.text(
            *(0.98, 0.03, "\n".join(words)),
            transform=axis.transAxes,
            ha="right",
            va="bottom",
            fontsize=SMALL_PT,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4},
            zorder=6,
        )
    _scales(axes, own, reach)
    _explain(figure, own, patient)
    return figure


def _measured(displacements: pd.DataFrame, patient: str) -> dict[str, pd.Series]:
    """Measured rotations (deg) by joint, on each bending film."""
    rows = displacements[displacements["specimen"] == patient]
    found = {}
    for position in _MARKS:
        there = rows[rows["position"] == position].drop_duplicates("joint")
        found[position] = there.set_index("joint")["measured_deg"]
    return found


def curve(row: pd.Series, reach: float) -> tuple[Array, Array]:
    """Rotations (deg) and moments (N m) of a law, as far as moments of that size.

    The stretch A is the stiffness at rest over the slope of ``tan(B r + C)`` at rest.
    """
    ends = _ends(row)
    moments = np.linspace(-reach, reach, POINTS)
    found: Array = DEG_PER_RAD * ends.rotation(moments / _stretch(ends, row))
    return found, moments


def _ends(row: pd.Series) -> EndRotations:
    return EndRotations(*(np.array([row[name]], dtype=float) / DEG_PER_RAD for name in _ENDS))


def _stretch(ends: EndRotations, row: pd.Series) -> float:
    b, c = ends.shape
    return float(row["at_rest_nm_per_rad"]) / float(b[0] * (1.0 + np.tan(c[0]) ** 2))


def _reach(rows: pd.DataFrame, pairs: Mapping[str, pd.Series]) -> float:
    """The largest moment to draw, N m: beyond those at the rotations of the bending films."""
    found = [1.0]
    for _, row in rows.iterrows():
        ends = _ends(row)
        for position in _MARKS:
            r = float(pairs[position].get(row["joint"], 0.0)) / DEG_PER_RAD
            if ends.lower[0] < r < ends.upper[0]:
                found.append(abs(_stretch(ends, row) * float(ends.load(np.array([r]))[0])))
    return _LARGEST * max(found)


def _laws(axis: Axes, rows: pd.DataFrame, reach: float) -> None:
    axis_lines(axis)
    axis.axhline(0.0, color=GREY, lw=0.3, zorder=0)
    axis.axvline(0.0, color=GREY, lw=0.3, zorder=0)
    for _, row in rows.iterrows():
        look = STYLES[str(row["model"])]
        axis.plot(*curve(row, reach), **look.line(zorder=3))
        for name in _ENDS:
            axis.axvline(float(row[name]), color=look.color, lw=0.6, ls=(0, (1, 1.5)), zorder=2)


def _scales(axes: Sequence[Axes], rows: pd.DataFrame, reach: float) -> None:
    """The same for all segments, so that stiff ones look stiff."""
    low, high = float(rows[_ENDS[0]].min()), float(rows[_ENDS[1]].max())
    for number, axis in enumerate(axes):
        if number % ACROSS == 0:
            axis.set_ylabel("moment (N m)")
        if number + ACROSS >= len(axes):
            axis.tick_params(labelbottom=True)
        if number >= ACROSS * ((len(axes) - 1) // ACROSS):
            axis.set_xlabel("right (°)")
        axis.set_xlim(1.06 * low, 1.06 * high)
        axis.set_ylim(-reach, reach)
        axis.xaxis.set_major_locator(MaxNLocator(4))
        axis.yaxis.set_major_locator(MaxNLocator(4))


def _explain(figure: Figure, rows: pd.DataFrame, patient: str) -> None:
    handles = key_of_lines(in_order(rows["model"]))
    handles += [
        Line2D([], [], color=GREY, lw=0.6, ls=(0, (1, 1.5)), label="ends of a law"),
        Line2D([], [], color=BLACK, marker="<", ls="", ms=3.5, mew=0, label="left bending film"),
        Line2D([], [], color=BLACK, marker=">", ls="", ms=3.5, mew=0, label="right bending film"),
    ]
    scale = {"apical_moment": "apical moment", "mean_stiffness": "mean stiffness"}
    words = (
        f"Patient {short(patient)}, whose error is in the middle of all. Rotation since the erect "
        f"film, moment about the segment. The size of moments comes "
        f"from the {scale[str(rows['scale_from'].iloc[0])]} that the study states, not from films."
    )
    explain_marks(figure, handles, words, len(handles))
