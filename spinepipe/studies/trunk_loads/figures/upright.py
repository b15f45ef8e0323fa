"""Figure: how the bodies of every person turn to stand upright with the least moments."""

import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import BODIES
from spinepipe.report.panels import explain_marks, head, side_by_side
from spinepipe.report.style import BLACK, GREY, blank, saying
from spinepipe.report.words import short
from spinepipe.studies.trunk_loads.figures.line_styles import key_of, look_of
from spinepipe.studies.trunk_loads.settings import TrunkLoads, reproduces

_HEIGHT_MM, _KEY_MM = 68.0, 17.0
MOST_PERSONS = 6


def upright_figure(study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Rotations of bodies, and moments at the joints below them."""
    rows = tables["upright"]
    if rows.empty:
        return saying("Nobody's upright posture was found.")
    persons = list(dict.fromkeys(rows["specimen"]))[:MOST_PERSONS]
    figure = blank(_HEIGHT_MM + _KEY_MM)
    turned, moments = side_by_side(figure, 2, 2, sharey=True)
    head(turned, 0, "Rotation, extension positive")
    head(moments, 1, "Moment required at the joint below")
    for number, person in enumerate(persons):
        own = rows[rows["specimen"] == person].set_index("body").reindex(list(BODIES))
        for axis, column in ((turned, "upright_deg"), (moments, "moment_after_nm")):
            look = look_of(number).line(zorder=3)
            axis.plot(own[column].astype(float), range(len(BODIES)), **look)
    first = rows[rows["specimen"] == persons[0]].set_index("body").reindex(list(BODIES))
    turned.plot(first["start_deg"].astype(float), range(len(BODIES)), color=GREY, lw=0.8, zorder=1)
    before = first["moment_before_nm"].astype(float)
    moments.plot(before, range(len(BODIES)), color=GREY, lw=0.8, zorder=1)
    printed = reproduces(cohort.name)
    if printed:  # Table 2 of the paper, whose geometry is another
        text = files("spinepipe.studies.trunk_loads.figures").joinpath("ghezelbash_2016.toml")
        table = tomllib.loads(text.read_text(encoding="utf-8"))
        at = [BODIES.index(body) for body in table["bodies"]]
        for angles in table["upright_deg"].values():
            turned.plot(angles, at, "x", color=BLACK, ms=3.5, mew=0.7, zorder=2)
    for axis, unit in ((turned, "from the source's pose (°)"), (moments, "extension (N m)")):
        axis.axvline(0.0, color=BLACK, lw=0.5, zorder=0)
        axis.set_xlabel(unit)
    turned.set_yticks(range(len(BODIES)), BODIES)
    turned.set_ylim(-0.5, len(BODIES) - 0.5)
    _explain(figure, persons, printed, int(rows["specimen"].nunique()))
    return figure


def _explain(figure: Figure, persons: list[str], printed: bool, n: int) -> None:
    handles = key_of({short(name): look_of(k) for k, name in enumerate(persons)})
    handles.append(Line2D([], [], color=GREY, lw=0.8, label=f"at the start, {short(persons[0])}"))
    if printed:
        mark: dict[str, Any] = {"marker": "x", "color": BLACK, "ls": "", "ms": 3.5, "mew": 0.7}
        handles.append(Line2D([], [], **mark, label="Ghezelbash 2016 Table 2"))
    words = f"The first {len(persons)} of {n} persons." if n > len(persons) else ""
    explain_marks(figure, handles, words, 4)
