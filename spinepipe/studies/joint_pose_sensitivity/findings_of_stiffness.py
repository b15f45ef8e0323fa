"""Stiffness of a joint-pose study as sentences: what is held by the data, and what is not."""

import numpy as np
import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.panels import EVERY_JOINT
from spinepipe.report.words import AXIS, count, number, percent
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.filters import near_start
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

MOSTLY = 0.5
"""Where more fits have an open region, the median value is one that the data do not exclude."""


def stiffness(study: JointPoseSensitivity, results: ResultTables) -> str:
    """Median stiffness, with a warning where the data do not hold it."""
    rows = results.table("summary")
    if rows.empty:
        return ""
    chosen = rows[
        (rows["part"] == "poses")
        & (rows["dataset"] == "reduced")
        & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])
    solved = _reduced(results)
    kept = _kept_starts(study, results)
    chosen = chosen[~chosen["coordinate"].isin(list(kept))]
    is_open = chosen["open_share"].astype(float) > MOSTLY
    held = [
        _medians(part, chosen) + _doubt(solved, str(name), part)
        for name, part in chosen[~is_open].groupby("coordinate", sort=False)
    ]
    not_held = [
        _not_held(part, chosen) for _, part in chosen[is_open].groupby("coordinate", sort=False)
    ]
    told = (
        f"Median stiffness over the reduced poses: {'; '.join(held)}." if held else "",
        f"Not held by the data: {'; '.join(not_held)}." if not_held else "",
        f"Nothing is known of {'; '.join(kept.values())}." if kept else "",
        _exact(solved) if held or not_held or kept else "",
    )
    return " ".join(words for words in told if words)


def _kept_starts(study: JointPoseSensitivity, results: ResultTables) -> dict[str, str]:
    """Coordinates whose stiffness most fits left where it started, and in words how many.

    Such a value is the study's own input; a median of it is no result. Values that the data hold
    are left alone, wherever they are.
    """
    fitted = results.table("calibrations")
    if fitted.empty:
        return {}
    solved = fitted[fitted["status"].isin(USABLE)]
    found: dict[str, str] = {}
    for name, column, start in zip(
        COORDINATES, STIFFNESS_COLUMNS, study.stiffness.in_order(), strict=True
    ):
        if name not in study.calibration.free or not {column, f"{name}_identifiable"} <= {*solved}:
            continue
        values = solved[[column]].to_numpy(float)
        near = near_start(values, np.array([start]), study.success.near_start_percent)[:, 0]
        lost = near & ~solved[f"{name}_identifiable"].fillna(False).to_numpy(bool)
        if lost.sum() > MOSTLY * len(solved):
            title = AXIS[name].lower()
            found[name] = f"{title}: {lost.sum()} of {len(solved)} fits left it at its start"
    return found


def _not_held(part: pd.DataFrame, chosen: pd.DataFrame) -> str:
    """Which stiffness most fits do not hold, and above what it lies."""
    first = part.iloc[0]
    title = AXIS[first["coordinate"]].lower()
    every = chosen[chosen["coordinate"] == first["coordinate"]]
    if len(every) > 1:
        return f"{title} in {len(part)} of {_all(every)}"
    told = (
        f"{title}, whose region is open in {percent(first['open_share'] * first['n'], first['n'])}"
    )
    if pd.isna(first["lower_end_median"]):
        return f"{told} of fits"
    ends = (
        f"{number(first['lower_end_low_quartile'])} to {number(first['lower_end_high_quartile'])}"
    )
    return f"{told} of fits; lower ends {ends} {first['unit']} (IQR)"


def _reduced(results: ResultTables) -> pd.DataFrame:
    """Solved fits of the reduced poses."""
    fitted, success = results.table("calibrations"), results.table("success")
    if fitted.empty:
        return fitted
    solved = fitted[fitted["status"].isin(USABLE)]
    if success.empty:
        return solved
    kept = success.loc[success["reduced"], ["specimen", "pose"]]
    return solved.merge(kept, on=["specimen", "pose"])


def _medians(part: pd.DataFrame, chosen: pd.DataFrame) -> str:
    """Median and IQR, or the lowest and highest median of several specimens or joints."""
    first = part.iloc[0]
    title = AXIS[first["coordinate"]].lower()
    if len(part) == 1:
        every = chosen[chosen["coordinate"] == first["coordinate"]]
        whose = f"{place}, " if (place := _place(first, every)) and len(every) > 1 else ""
        iqr = f"{number(first['low_quartile'])} to {number(first['high_quartile'])}"
        return f"{title} {number(first['median'])} {first['unit']} ({whose}IQR {iqr})"
    ordered = part.sort_values("median", kind="stable")
    low, high = ordered.iloc[0], ordered.iloc[-1]
    if number(low["median"]) == number(high["median"]):
        return f"{title} {number(low['median'])} {first['unit']} in all {_all(part)}"
    names = [_place(row, part) for row in (low, high)]
    return (
        f"{title} {number(low['median'])} ({names[0]}) to {number(high['median'])} {first['unit']} "
        f"({names[1]}), medians of {_all(part)}"
    )


def _all(part: pd.DataFrame) -> str:
    """``2 specimens``, ``3 joints`` or ``6 joints of 2 specimens``."""
    specimens = count(part["specimen"].nunique(), "specimen")
    if (part["joint"] == EVERY_JOINT).all():
        return specimens
    joints = count(len(part), "joint")
    return joints if part["specimen"].nunique() == 1 else f"{joints} of {specimens}"


def _place(row: pd.Series, part: pd.DataFrame) -> str:
    words = [row["specimen"]] if part["specimen"].nunique() > 1 else []
    words += [row["joint"]] if row["joint"] != EVERY_JOINT else []
    return " ".join(words)


def _doubt(solved: pd.DataFrame, name: str, part: pd.DataFrame) -> str:
    """The share of fitted values that the data do not hold, where there are any."""
    if solved.empty:
        return ""
    own = solved.merge(part[["specimen", "joint"]].drop_duplicates())
    flags = own[f"{name}_identifiable"].dropna()
    lost = int((~flags.astype(bool)).sum())
    if not lost:
        return ""
    share = percent(lost, len(flags))
    return f", but not identifiable in {lost} of {len(flags)} fitted ({share})"


def _exact(solved: pd.DataFrame) -> str:
    """What too few readings mean, where there are too few."""
    if solved.empty:
        return ""
    each = solved.drop_duplicates(["specimen", "pose"])["degrees_of_freedom"]
    few = int((each <= 0).sum())
    if not few:
        return ""
    if (each == 0).all():
        return "All fits are exact: as many readings as unknowns, so no misfit can show."
    which = f"All {len(each)} fits" if few == len(each) else f"{few} of {len(each)} fits"
    return f"{which} have no more readings than unknowns: such fits are exact or undetermined."
