"""Rows of recorded lifts: which lifts there are, when hands take the load, and the largest load."""

from dataclasses import dataclass

import pandas as pd

from spinepipe.facts import number
from spinepipe.studies.trunk_loads.samples import Tables
from spinepipe.studies.trunk_loads.selection import Row, named, sound

GUIDELINE_N = number(__name__, "compression_guideline")
"""Compression of a lumbar disc above which lifting guidelines see a danger."""

L4L5, L5S1 = "L4L5", "L5S1"


def lifts_of(tables: Tables) -> list[tuple[str, str]]:
    """(specimen, trial) of each lift, in the order of the table."""
    rows = tables.get("lift_loads", pd.DataFrame())
    if rows.empty:
        return []
    pairs = rows[["specimen", "trial"]].drop_duplicates().to_numpy(str).tolist()
    return [(specimen, trial) for specimen, trial in pairs]


def of_lift(rows: pd.DataFrame, specimen: str, trial: str) -> pd.DataFrame:
    """Rows of a lift, by time; none of a table that is absent."""
    if rows.empty:
        return rows
    own = rows[(rows["specimen"] == specimen) & (rows["trial"] == trial)]
    return own.sort_values("time_s", kind="stable")


def lift_off_s(frames: pd.DataFrame) -> float | None:
    """When hands first bear half of the most that they bear; None where they lift nothing, or bear
    it from the beginning."""
    borne = frames["load_n"].astype(float)
    half = borne >= 0.5 * borne.max()
    if not half.any() or half.iloc[0]:
        return None
    return float(frames["time_s"][half].iloc[0])


@dataclass(frozen=True, eq=False)
class LargestLoad:
    """The frame of a lift in which L4L5 carries most, of those that are held.

    Attributes
    ----------
    row : of table lift_loads. band : of table lift_bands, of the same frame; empty where not known.
    after_s : since hands bear the load; None where that is not known.
    """

    row: Row
    band: Row
    after_s: float | None


def largest_load(tables: Tables, specimen: str, trial: str) -> LargestLoad | None:
    """None where no frame of the lift is held."""
    loads = of_lift(tables["lift_loads"], specimen, trial)
    held = named(loads[sound(loads) & (loads["level"] == L4L5)])
    if not held:
        return None
    row = max(held, key=lambda one: float(one["compression_n"]))
    bands = of_lift(tables.get("lift_bands", pd.DataFrame()), specimen, trial)
    if len(bands):
        bands = bands[(bands["level"] == L4L5) & (bands["time_s"] == row["time_s"])]
    off = lift_off_s(of_lift(tables["lift_frames"], specimen, trial))
    after = None if off is None else float(row["time_s"]) - off
    known = bands.dropna(subset="low") if len(bands) else bands
    return LargestLoad(row, named(known)[0] if len(known) else {}, after)
