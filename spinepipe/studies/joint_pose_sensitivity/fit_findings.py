"""Findings about the fits of sampled poses: how many count, and the stiffness they gave."""

import pandas as pd

from spinepipe.report.page.results import Results
from spinepipe.report.rows import EVERY_JOINT
from spinepipe.report.settling import settling
from spinepipe.report.words import AXIS, count, number, percent, tick
from spinepipe.statics.status import Status
from spinepipe.studies import JointPoseSensitivity

_COUNTS = ("fits", "solved", "near_start_any", "near_start_all", "outliers", "reduced")


def fits(study: JointPoseSensitivity, results: Results) -> str:
    """How many fits are in the reduced dataset, and why the others are not."""
    rows = results.table("counts")
    if rows.empty or not (rows["part"] == "poses").any():
        return ""
    poses = rows[rows["part"] == "poses"]
    sums = {name: int(poses[name].sum()) for name in _COUNTS}
    near = "near_start_all" if study.success.failed_when == "all" else "near_start_any"
    which = "all free stiffnesses" if near.endswith("all") else "a free stiffness"
    percents = tick(study.success.near_start_percent)
    lost = (
        f"{sums[near]} had not moved ({which} within {percents} % of the start) and "
        f"{sums['outliers']} {'was an outlier' if sums['outliers'] == 1 else 'were outliers'}"
    )
    share = percent(sums["reduced"], sums["fits"])
    kept = f"{count(sums['reduced'], 'fit')} of {sums['fits']} ({share})"
    return f"{kept} are in the reduced dataset: {sums['solved']} ended with a stiffness, {lost}."


def settled(study: JointPoseSensitivity, results: Results) -> str:
    """That motion and stiffness belong to different times after loading, where they do."""
    return settling(study)


def stiffness(study: JointPoseSensitivity, results: Results) -> str:
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
    parts = [
        _medians(part) + _doubt(solved, str(name))
        for name, part in chosen.groupby("coordinate", sort=False)
    ]
    if not parts:
        return ""
    told = f"Median stiffness over the reduced poses: {'; '.join(parts)}."
    return " ".join(words for words in (told, _exact(solved)) if words)


def _reduced(results: Results) -> pd.DataFrame:
    """Solved fits of the reduced poses."""
    fitted, success = results.table("calibrations"), results.table("success")
    if fitted.empty:
        return fitted
    usable = [status.value for status in Status if status.usable]
    solved = fitted[fitted["status"].isin(usable)]
    if success.empty:
        return solved
    kept = success.loc[success["reduced"], ["specimen", "pose"]]
    return solved.merge(kept, on=["specimen", "pose"])


def _medians(part: pd.DataFrame) -> str:
    """Median and IQR, or the lowest and highest median of several specimens or joints."""
    first = part.iloc[0]
    title = AXIS[first["coordinate"]].lower()
    if len(part) == 1:
        iqr = f"{number(first['low_quartile'])} to {number(first['high_quartile'])}"
        return f"{title} {number(first['median'])} {first['unit']} (IQR {iqr})"
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


def _doubt(solved: pd.DataFrame, name: str) -> str:
    """The share of fitted values that the data do not hold, where there are any."""
    if solved.empty:
        return ""
    flags = solved[f"{name}_identifiable"].dropna()
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
