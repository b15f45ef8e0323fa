"""Figures of recorded lifts: loads over time."""

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, COLORS, FOURTH, MODEL, THIRD, Look
from spinepipe.report.words import number, plain, short
from spinepipe.studies.trunk_loads.lift_rows import (
    GUIDELINE_N,
    L4L5,
    L5S1,
    lift_off_s,
    lifts_of,
    of_lift,
)
from spinepipe.studies.trunk_loads.samples import Tables
from spinepipe.studies.trunk_loads.selection import sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads

LOOKS = (MODEL, BASE, THIRD, FOURTH)
LIMIT = Look(COLORS["ink"], "o", (0, (1.0, 2.0)))
NOT_HELD = Look(COLORS["soft"], "v")

COMPRESSION = "compression_n"

PANELS = {
    "Compression of L4–L5": (L4L5, COMPRESSION, "compression (N)"),
    "Shear of L4–L5": (L4L5, "shear_anterior_n", "shear (N), + forwards"),
    "Moment of muscles at L5–S1": (L5S1, "required_extension_nm", "extension moment (N m)"),
}
"""By title: level, column, words of the axis."""


def over_time(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Compression, shear and moment of each lift, bands where persons were drawn."""
    title, lifts = "Load over a lift", lifts_of(tables)[: len(LOOKS)]
    if not lifts:
        return saying(title, "No lift was recorded.")
    several = len({specimen for specimen, _ in lifts}) > 1
    names = [short(plain(f"{who}, {trial}" if several else trial), 24) for who, trial in lifts]
    offs = [lift_off_s(of_lift(tables["lift_frames"], *lift)) for lift in lifts]
    known = all(off is not None for off in offs)
    looks = dict(zip(names, LOOKS, strict=False))
    lost, panels = False, []
    for heading, (level, column, words) in PANELS.items():
        frames = []
        for name, lift, off in zip(names, lifts, offs, strict=True):
            rows = of_lift(tables["lift_loads"], *lift)
            rows = rows[rows["level"] == level]
            start = float(off or 0.0) if known else 0.0
            line = pd.DataFrame(
                {"x": rows["time_s"].astype(float) - start, "y": rows[column].astype(float)}
            )
            weak = line[~sound(rows)].assign(series="")
            lost = lost or len(weak) > 0
            if column == COMPRESSION:
                line = _with_band(line, of_lift(tables["lift_bands"], *lift), level, start)
            frames += [one for one in (line.assign(series=name), weak) if len(one)]
        if column == COMPRESSION:
            x = pd.concat(frames)["x"]
            ends = {"x": [x.min(), x.max()], "y": GUIDELINE_N, "series": "limit"}
            frames.append(pd.DataFrame(ends))
        panels.append(
            Curves(
                title=heading,
                x_label="time since the load left the floor (s)" if known else "time (s)",
                y_label=words,
                frame=pd.concat(frames, ignore_index=True),
                looks={**looks, "limit": LIMIT, "": NOT_HELD},
                points=("",),
                width=400.0,
                high=210.0,
            )
        )
    keys = [Key(look, name, as_line=True) for name, look in looks.items()]
    keys.append(Key(LIMIT, f"{number(GUIDELINE_N)} N of lifting guidelines", as_line=True))
    keys += [Key(NOT_HELD, "not held by the model: do not use")] if lost else []
    band = "Band: 95 % of persons drawn." if len(tables["lift_bands"]) else "No bands: none drawn."
    return Chart(title, panels, f"Inertia is counted. {band}", keys)


def _with_band(line: pd.DataFrame, bands: pd.DataFrame, level: str, start: float) -> pd.DataFrame:
    """The line with its band, which is straight between the frames that were sampled."""
    own = bands[bands["level"] == level] if len(bands) else bands
    if own.empty:
        return line
    # a frame without an interval leaves none to either side of it: NaN goes through `interp`
    at = own["time_s"].to_numpy(float) - start
    ends = {
        f"y_{end}": np.interp(line["x"], at, own[end].to_numpy(float), left=np.nan, right=np.nan)
        for end in ("low", "high")
    }
    return line.assign(**ends)
