"""Figures of stiffness: what it costs to hold it, and calibrated values beside the prior."""

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import JOINTS
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import COLORS, MODEL, SEVERAL, SOFT, Look
from spinepipe.report.forms.rows import Rows, ordered
from spinepipe.report.words import AXIS, capital, count, level, plain, short
from spinepipe.studies.tracking.conclusions_of_errors import Tables
from spinepipe.studies.tracking.conclusions_of_stiffness import (
    calibrated_values,
    judged_profiles,
    law_told_of,
)
from spinepipe.studies.tracking.profile import PROFILED, REGIONS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import LIMIT
from spinepipe.studies.tracking.words import phrase
from spinepipe.units import ROTATIONS

MOST_SUBJECTS = 4
TOP = 4.0
"""Top of a profile's panel, times the limit; what costs more leaves it."""

PRIOR = Look(COLORS["soft"], "|")

SAYS = {
    "told": "bounded",
    "one_sided": "bounded on one side",
    "edge": "falls to the {end}",
    "gap": "not bounded",
    "flat": "nothing excluded",
    "lost": "nothing to compare",
}
"""What a profile says, short enough for a heading."""


def stiffness_profiles(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each coordinate and region, a line for each subject."""
    title = "Whether markers tell stiffness"
    points = tables["profile_points"].dropna(subset=["cost_over_best"])
    if points.empty:
        return saying(title, "There is no profile of stiffness whose fits converged.")
    said = judged_profiles(tables)
    who = [str(name) for name in dict.fromkeys(points["specimen"])][:MOST_SUBJECTS]
    lines = dict(zip(who, SEVERAL, strict=False))
    marks = {f"{name} ": look for name, look in lines.items()}  # the same as symbols
    reach = 0.8 * float(points["ratio"].min()), 1.25 * float(points["ratio"].max())
    limit = pd.DataFrame({"x": reach, "y": LIMIT, "series": "limit"})
    how: dict[str, Any] = {"x_log": True, "x_limits": reach, "y_limits": (-0.5, TOP * LIMIT)}
    how |= {"looks": {"limit": SOFT, **lines, **marks}, "points": tuple(marks), "high": 200.0}
    how["y_label"] = "cost over the least"
    panels = []
    for coordinate, region in product(PROFILED, REGIONS):
        own, verdicts = (
            rows[(rows["coordinate"] == coordinate) & (rows["region"] == region)]
            for rows in (points[points["specimen"].isin(who)].sort_values("point"), said)
        )
        if own.empty:
            continue
        drawn = own.rename(columns={"ratio": "x", "cost_over_best": "y", "specimen": "series"})
        symbols = drawn.assign(series=drawn["series"] + " ")
        words = [SAYS[row["says"]].format(end=row["end"]) for row in verdicts.to_dict("records")]
        heading = ": ".join([capital(plain(region)), *(words if len(words) == 1 else [])])
        label = f"{AXIS[coordinate].lower()}: stiffness over generic"
        frame = pd.concat([limit, drawn, symbols], ignore_index=True)[["x", "y", "series"]]
        panels.append(Curves(title=heading, x_label=label, frame=frame, **how))
    keys = [Key(look, short(name)) for name, look in lines.items()]
    keys.append(Key(SOFT, f"95 % limit, {LIMIT}", as_line=True))
    caption = "What lies above the dashed line is excluded; lines that leave a panel cost more."
    return Chart(title, panels, caption, keys)


def stiffness_by_level(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each rotation, a row for each joint from above; full where data moved a value."""
    title = "Calibrated stiffness beside the prior"
    rows = tables["stiffness"]
    values = calibrated_values(study, cohort, rows) if len(rows) else rows
    if not len(values):
        return saying(title, "No calibration loaded any joint.")
    law = law_told_of(values)
    values = values[values["law"] == law].assign(series="calibrated", hollow=~values["outside"])
    values = values.rename(columns={"ratio_to_generic": "value"})
    ends = ["prior_low", "prior_high"]
    prior = values.groupby(["joint", "coordinate"], observed=True)[ends].median().reset_index()
    prior = prior.rename(columns={"prior_low": "low", "prior_high": "high"})
    both = pd.concat([prior.assign(series="prior", value=np.nan, hollow=False), values])
    both = ordered(both.assign(row=both["joint"].map(level)), "joint", JOINTS[::-1])
    sizes = both[["value", "low", "high"]].to_numpy(float)
    how: dict[str, Any] = {"looks": {"prior": PRIOR, "calibrated": MODEL}, "log": True}
    how["x_limits"] = 0.85 * np.nanmin(sizes), 1.15 * np.nanmax(sizes)
    panels = [
        Rows(title=AXIS[coordinate], x_label="stiffness over generic", frame=own, **how)
        for coordinate in ROTATIONS
        if len(own := both[both["coordinate"] == coordinate])
    ]
    caption = (
        f"{capital(phrase(law))}, a symbol for each side of a joint of "
        f"{count(values['specimen'].nunique(), 'subject')}; line: 95 % range of the prior alone."
    )
    keys = [
        Key(MODEL, "outside the prior's range"),
        Key(MODEL, "within it: not informed", hollow=True),
        Key(PRIOR, "prior alone", as_line=True),
    ]
    return Chart(title, panels, caption, keys)
