"""Figures of range of motion: how far every joint moves, and what that comes from."""

from collections.abc import Mapping

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.look import MODEL, SEVERAL
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import AXIS, POSITIVE, case, level
from spinepipe.studies.range_of_motion.conclusions import SOURCES, whole
from spinepipe.studies.range_of_motion.settings import RangeOfMotion


def motion(study: RangeOfMotion, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Chart:
    """Motion in the loaded coordinate, a panel for each test and a row for each joint."""
    title = "Range of motion"
    summary = whole(cohort, tables["rom_summary"])
    loaded = summary[(summary["role"] == "loaded") & (summary["n"] > 0)]
    if loaded.empty:
        return saying(title, "No run has an equilibrium: there is no motion to show.")
    panels = []
    for test, rows in loaded.groupby("test", sort=False):
        columns = {
            "median": "value", "percentile_5": "low", "percentile_95": "high",
            "low_quartile": "inner_low", "high_quartile": "inner_high",
        }  # fmt: skip
        frame = rows.rename(columns=columns).assign(row=rows["joint"].map(level))[::-1]
        coordinate = rows["coordinate"].iloc[0]
        label = f"{AXIS[coordinate].lower()} (°), + {POSITIVE[coordinate]}"
        panels.append(Rows(title=case(str(test)), x_label=label, frame=frame, looks={"": MODEL}))
    caption = "Symbol: median of all runs; thick line: middle half; thin line: middle 90 %."
    return Chart(title, panels, caption)


def shares(study: RangeOfMotion, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Chart:
    """Shares of the variance with intervals, a panel for each test and a row for each joint."""
    title = "Where the variance of motion comes from"
    variance = whole(cohort, tables["rom_variance"])
    done = variance[variance["status"] == "done"]
    if done.empty:
        why = "; ".join(dict.fromkeys(variance["message"].iloc[:1]))
        return saying(title, f"There are no shares of variance: {why}.")
    names = [name for name in SOURCES if done[f"{name}_share"].notna().any()]
    looks = {SOURCES[name]: look for name, look in zip(names, SEVERAL, strict=False)}
    panels = []
    for test, rows in done.groupby("test", sort=False):
        parts = [
            pd.DataFrame(
                {
                    "row": rows["joint"].map(level),
                    "series": SOURCES[name],
                    "value": 100.0 * rows[f"{name}_share"],
                    "low": 100.0 * rows[f"{name}_low"],
                    "high": 100.0 * rows[f"{name}_high"],
                }
            )[::-1]
            for name in names
        ]
        label = "share of variance (%)"
        panels.append(
            Rows(
                title=case(str(test)),
                x_label=label,
                frame=pd.concat(parts),
                looks=looks,
                x_limits=(0.0, 100.0),
            )
        )
    first = done.iloc[0]
    caption = (
        f"Symbol: estimate; line: 95 % interval, over {first['n_specimens']} specimens, "
        f"{first['n_poses']} joint frames of each and {first['n_stiffness']} stiffness sets."
    )
    keys = [Key(look, name) for name, look in looks.items()]
    return Chart(title, panels, caption, keys)
