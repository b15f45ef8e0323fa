"""Figure of net moments over time, beside measured ones."""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MEASURED, MODEL
from spinepipe.report.words import case, level, plain, short
from spinepipe.studies.recordings import MEASURED_MOMENTS, of_trial
from spinepipe.studies.tracking.conclusions_of_errors import Tables
from spinepipe.studies.tracking.conclusions_of_moments import told_method
from spinepipe.studies.tracking.settings import Tracking

LOOKS = {"measured": MEASURED, "moving": MODEL, "still": BASE}
MOST_PANELS = 6


def moments(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each trial: the moment in extension at the joint that was measured, else L5S1."""
    title = "Net moment over time, computed and measured"
    rows = tables["joint_moments"]
    if rows.empty:
        return saying(title, "No trial moves.")
    joint, method = told_method(tables["moment_agreement"])
    rows = rows[rows["joint"] == joint]
    panels = []
    for (specimen, trial), own in rows.groupby(["specimen", "trial"], sort=False, observed=True):
        parts = [
            pd.DataFrame({"x": own["time_s"], "y": own[column].astype(float), "series": series})
            for series, column in (("moving", "extension_nm"), ("still", "still_extension_nm"))
        ]
        if method:
            known = of_trial(cohort, MEASURED_MOMENTS, str(specimen), str(trial))
            known = known[(known["joint"] == joint) & (known["method"] == method)]
            one = {"x": known["time_s"], "y": known["mz_nm"], "series": "measured"}
            parts.insert(0, pd.DataFrame(one))
        panels.append(
            Curves(
                title=short(case(str(trial)), 30),
                x_label="time (s)",
                y_label=f"moment at {level(joint)} (N m)",
                frame=pd.concat(parts, ignore_index=True),
                looks=LOOKS,
            )
        )
    words = {"moving": "computed", "still": "computed without accelerations"}
    keys = [Key(MEASURED, f"measured {plain(method)}", as_line=True)] if method else []
    keys += [Key(LOOKS[name], text, as_line=True) for name, text in words.items()]
    caption = "Net moment on all above the joint, + extension, which holds a trunk bent forwards."
    return Chart(title, panels[:MOST_PANELS], caption, keys)
