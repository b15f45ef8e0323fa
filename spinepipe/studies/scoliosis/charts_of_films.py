"""Figures of one spine: how far laws put its vertebrae off, and its laws segment by segment.

The spine is that of the median error. It is not named: films are of a person.
"""

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.forms.chart import Chart, Key, Panel, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import MEASURED
from spinepipe.report.words import case, level
from spinepipe.studies.scoliosis.charts import LOOKS, SHORT, Tables
from spinepipe.studies.scoliosis.errors import held_out_error
from spinepipe.studies.scoliosis.films import ERECT, HELD_OUT, LEFT, RIGHT, read_films
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tangent_laws import EndRotations
from spinepipe.units import DEG_PER_RAD, MM_PER_M

MOST_POSITIONS, MOST_JOINTS, POINTS = 4, 6, 41
"""Films and segments that are shown; points of a curve."""

_ENDS = ["lower_end_deg", "upper_end_deg"]
_LARGEST = 1.25
"""Axes reach this far beyond the largest moment on a bending film."""


def median_spine(positions: pd.DataFrame) -> str | None:
    """The spine whose error of rotations is the median; None where no law has a pose."""
    errors = held_out_error(positions)
    return None if errors.empty else str(errors.index[round(0.5 * (len(errors) - 1))])


def film_overlay(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each film: how far to the right of its place each law has each vertebra."""
    title = "One spine: vertebrae off their places"
    positions, rows = tables["positions"], tables["displacements"]
    spine = median_spine(positions)
    if spine is None:
        return saying(title, "No law has a pose on any film.")
    read = read_films(cohort, spine)
    films = read.films
    there = [name for name in films if name != ERECT]
    usual = [name for name in (*HELD_OUT, RIGHT, LEFT) if name in there]
    shown = [*usual, *(name for name in there if name not in usual)][:MOST_POSITIONS]
    own = rows[rows["specimen"] == spine].dropna(subset=["off_right_mm"])
    largest = 1.1 * float(own["off_right_mm"].abs().max()) or 1.0
    panels: list[Panel] = []
    for position in shown:
        lines = []
        for law in LOOKS:
            row = own[(own["position"] == position) & (own["model"] == law)]
            if len(row):
                off = np.append(0.0, row["off_right_mm"])
                up = MM_PER_M * films[position].up[np.append(True, read.compared(position)[1:])]
                lines.append(pd.DataFrame({"x": off, "y": up, "series": law}))
        if not lines:
            continue
        fitted = position in (RIGHT, LEFT)
        panels.append(
            Curves(
                title=f"{case(position)}, {'fitted' if fitted else 'left out'}",
                x_label="off to the right (mm)",
                y_label="height (mm)",
                frame=pd.concat(lines),
                looks=LOOKS,
                x_limits=(-largest, largest),
                width=220.0,
            )
        )
    keys = [Key(LOOKS[law], SHORT[law], as_line=True) for law in LOOKS if law in set(own["model"])]
    caption = (
        "The spine of the median error, seen from behind; its lowest and top vertebra are given."
    )
    return Chart(title, panels, caption, keys)


def load_displacement(study: Scoliosis, cohort: Cohort, tables: Tables) -> Chart:
    """Moment over lateral rotation, a panel for each of some segments of one spine."""
    title = "One spine: laws of its segments"
    laws, positions = tables["laws"], tables["positions"]
    ended = laws[laws[_ENDS].notna().all(axis=1)]
    if ended.empty:
        return saying(title, "No law of this study has ends.")
    names = ended["specimen"].unique()
    spine = median_spine(positions[positions["specimen"].isin(names)]) or str(names[0])
    own = ended[ended["specimen"] == spine]
    joints = [name for name in reversed(cohort.joint_names) if (own["joint"] == name).any()]
    chosen = np.unique(np.linspace(0, len(joints) - 1, MOST_JOINTS).round().astype(int))
    on_films = tables["displacements"]
    on_films = on_films[on_films["specimen"] == spine]
    on_films = on_films[on_films["position"].isin([RIGHT, LEFT])]
    on_films = on_films.drop_duplicates(["position", "joint"])
    limits = (1.05 * float(own[_ENDS[0]].min()), 1.05 * float(own[_ENDS[1]].max()))
    reach = _reach(own, on_films)
    panels: list[Panel] = []
    for joint in (joints[at] for at in chosen):
        parts = []
        for _, row in own[own["joint"] == joint].iterrows():
            r, moment = curve(row, reach)
            parts.append(pd.DataFrame({"x": r, "y": moment, "series": str(row["model"])}))
        film = on_films.loc[on_films["joint"] == joint, "measured_deg"].dropna().to_numpy(float)
        parts.append(pd.DataFrame({"x": film, "y": 0.0, "series": "films"}))
        panels.append(
            Curves(
                title=level(joint),
                x_label="rotation to the right (°)",
                y_label="moment (N m)",
                frame=pd.concat(parts),
                looks={**LOOKS, "films": MEASURED},
                points=("films",),
                x_limits=limits,
                y_limits=(-reach, reach),
            )
        )
    keys = [Key(LOOKS[law], SHORT[law], as_line=True) for law in LOOKS if law in set(own["model"])]
    keys.append(Key(MEASURED, "rotations on the bending films"))
    caption = (
        "The spine of the median error, some segments from the uppermost. The size of moments is "
        "stated, films show how segments compare."
    )
    return Chart(title, panels, caption, keys)


def curve(row: pd.Series, reach: float) -> tuple[Array, Array]:
    """Rotations (deg) and moments (N m) of a law, as far as moments of that size.

    The stretch A is the stiffness at rest over the slope of ``tan(B r + C)`` at rest.
    """
    ends, stretch = _law(row)
    moments = np.linspace(-reach, reach, POINTS)
    return DEG_PER_RAD * ends.rotation(moments / stretch), moments


def _law(row: pd.Series) -> tuple[EndRotations, float]:
    """Ends and stretch (N m)."""
    ends = EndRotations(*(np.array([row[name]], dtype=float) / DEG_PER_RAD for name in _ENDS))
    return ends, float(row["at_rest_nm_per_rad"]) / float(ends.at_rest(np.ones(1))[0])


def _reach(laws: pd.DataFrame, on_films: pd.DataFrame) -> float:
    """The largest moment to draw, N m: beyond those at the rotations of the bending films."""
    found = [1.0]
    for _, row in laws.iterrows():
        ends, stretch = _law(row)
        for r in on_films.loc[on_films["joint"] == row["joint"], "measured_deg"] / DEG_PER_RAD:
            if ends.lower[0] < r < ends.upper[0]:
                found.append(abs(stretch * float(ends.load(np.array([r]))[0])))
    return _LARGEST * max(found)
