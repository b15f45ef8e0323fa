"""Selectors for Gould et al. 2024, doi 10.3389/fbioe.2024.1304334, on the cohort after it.

The paper has one specimen; tables are its rows. The landmarks' SD and the load point are not
published (docs/decisions/0001): beside a number that hangs on one of them stands what the
assumption would have to be for the printed number, read off frames and fits made with others.
What its tests say is in `gould_2024a_significance`.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from papers import gould_2024a_significance as significance
from papers.gould_2024a_significance import FITTED, MEASURED_JOINTS
from papers.ranges import IQR_PER_SD, wilson_percent
from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import named

JOINTS = ("L1L2", "L2L3", "L3L4")
TRANSLATIONS = ("anterior", "superior", "right")
STIFFNESS = {
    "anterior": "anterior_n_per_m",
    "superior": "superior_n_per_m",
    "extension": "extension_nm_per_rad",
}
MOTION = {"anterior": "anterior_mm", "superior": "superior_mm", "extension": "extension_deg"}

PER_AXIS_MM = 2.9 / sqrt(3.0)
"""SD per axis if 2.9 mm is that of the resultant of three equal axes."""

LARGEST_ORIGIN_IQR_MM = 1.04
"""Printed of joint origins, Table 7."""

FEWEST_OF_A_RATE = 10
"""Trials of which a rate is told: all of 3 leave 44 to 100 %, all of 10 leave 72 to 100 %."""

CLOSE = 0.01
"""Relative distance from the median within which fits are counted in the notes."""

SAME = 1e-4
"""Spread relative to the median below which fits count as ended in the same stiffness."""


# --- cells of the summary -------------------------------------------------------------------------


def _value(run: StudyRun, column: str, **where: Any) -> float:
    return run.number("summary", column, **where)


def _each(where: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Single cells, of filters that name several values."""
    several = {name: value for name, value in where.items() if isinstance(value, tuple)}
    for values in product(*several.values()):
        yield where | dict(zip(several, values, strict=True))


def summary(run: StudyRun, column: str, **where: Any) -> Computed:
    """A column of one row, a median with its quartiles; of several rows the largest."""
    value = max(_value(run, column, **one) for one in _each(where))
    if column != "median" or len(list(_each(where))) > 1:
        return Computed(value)
    row = run.row("summary", **where)
    low, high = (
        None if pd.isna(row[name]) else float(row[name])
        for name in ("low_quartile", "high_quartile")
    )
    return Computed(value, low, high)


def percent_of_median(run: StudyRun, column: str, **where: Any) -> Computed:
    """A spread as a percentage of its median."""
    middle = _value(run, "median", **where)
    if middle == 0.0:
        raise NotComputed("the median is 0")
    return Computed(100.0 * _value(run, column, **where) / middle)


def ratio(run: StudyRun, column: str, what: str, **where: Any) -> Computed:
    """The first of two rows in the second; the filter with two values tells them apart."""
    first, second = (_value(run, column, **one) for one in _each(where))
    if second == 0.0:
        raise NotComputed(f"the {what} is 0")
    return Computed(first / second)


def percent_ratio(run: StudyRun, column: str, what: str, **where: Any) -> Computed:
    """The same of spreads in percent of their medians."""
    first, second = (percent_of_median(run, column, **one).value for one in _each(where))
    if second == 0.0:
        raise NotComputed(f"the {what} is 0")
    return Computed(first / second)


def largest_shift(run: StudyRun, column: str, **where: Any) -> Computed:
    """Largest size of a difference between reduced and complete dataset."""
    shifts = (
        _value(run, column, **one, dataset="reduced") - _value(run, column, **one, dataset="all")
        for one in _each(where)
    )
    return Computed(max(map(abs, shifts)))


def drop(run: StudyRun, column: str, **where: Any) -> Computed:
    """Complete less reduced dataset."""
    reduced, complete = (_value(run, column, **where, dataset=one) for one in ("reduced", "all"))
    return Computed(-(reduced - complete))


def share_lower(run: StudyRun) -> Computed:
    """Medians and ranges of error of both bootstraps that are lower quasi-static, percent."""
    lower = []
    parts = ("damping_bootstrap", "start_bootstrap")
    for part, joint, name, kind in product(parts, MEASURED_JOINTS, FITTED, ("median", "range")):
        where = {"part": part, "dataset": "all", "quantity": "error"}
        quasi_static, dynamic = (
            _value(run, kind, **where, joint=joint, coordinate=name, loading=loading)
            for loading in ("quasi_static", "dynamic")
        )
        lower.append(quasi_static < dynamic)
    return Computed(100.0 * sum(lower) / len(lower))


def _stiffness_where(part: str, dataset: str, coordinate: str) -> dict[str, str]:
    where = {"part": f"{part}_bootstrap", "loading": "quasi_static", "dataset": dataset}
    return where | {"quantity": "stiffness", "joint": "*", "coordinate": coordinate}


def stiffness_range(run: StudyRun, part: str, dataset: str, coordinate: str) -> Computed:
    """Range of fitted stiffness, with how many fits end close to the median."""
    where = _stiffness_where(part, dataset, coordinate)
    middle = _value(run, "median", **where)
    fits = run.rows("bootstrap", bootstrap=part, loading="quasi_static")
    values = fits.groupby("set")[STIFFNESS[coordinate]].first().dropna()
    close = int(((values - middle).abs() <= CLOSE * abs(middle)).sum())
    which = "" if dataset == "all" else ", outliers counted,"
    note = f"ours: {close} of {len(values)} fits{which} within {100.0 * CLOSE:g} % of the median"
    return Computed(_value(run, "range", **where), note=note)


def start_over_damping(run: StudyRun, coordinate: str) -> Computed:
    """Range of stiffness over start values in that over sets of damping."""
    both = [_stiffness_where(part, "all", coordinate) for part in ("start", "damping")]
    start, damping = (_value(run, "range", **where) for where in both)
    middle = _value(run, "median", **both[1])
    if max(start, damping) < SAME * middle or damping == 0.0:
        told = f"their ranges are {start / middle:.1e} and {damping / middle:.1e} of the median"
        raise NotComputed(f"all fits end in the same stiffness, {told}: no ratio has a meaning")
    return Computed(start / damping)


# --- what the landmarks' SD, or the load point, would have to be ----------------------------------


class _Spreads(NamedTuple):
    """Landmark SDs, mm, rising; at each the largest interquartile range of some cells, its ends."""

    sds: np.ndarray
    iqr: np.ndarray
    low: np.ndarray
    high: np.ndarray


def _spreads(run: StudyRun, **where: Any) -> _Spreads:
    rows = [run.rows("spread_over_landmark_sd", **one) for one in _each(where)]
    known = pd.concat(rows).dropna(subset=["iqr"])
    if known.empty:
        raise NotComputed("no landmark set defines a frame")
    largest = known.groupby("sd_mm")[["iqr", "iqr_low", "iqr_high"]].max().cummax()
    return _Spreads(largest.index.to_numpy(float), *(largest[n].to_numpy(float) for n in largest))


def _at(x: float, xs: np.ndarray, ys: np.ndarray) -> float:
    """Straight between points and from 0, 0."""
    return float(np.interp(x, np.r_[0.0, xs], np.r_[0.0, ys]))


def frame_spread(
    run: StudyRun, printed: float, dataset: str, quantity: str, joint: Any, coordinate: Any
) -> Computed:
    """Largest interquartile range of cells of joint frames, with the landmark SD of the printed."""
    cells = {"quantity": quantity, "joint": joint, "coordinate": coordinate}
    poses = {"part": "poses", "loading": "equilibrium", "dataset": dataset}
    return replace(summary(run, "iqr", **poses, **cells), note=_needed_sd(run, printed, **cells))


def _needed_sd(run: StudyRun, printed: float, **cells: Any) -> str:
    """``ours: a landmark SD of 2.2 mm (2.0 to 2.5) per axis ...``; nothing without the table."""
    try:
        found = _spreads(run, **cells)
    except NotComputed:
        return ""
    if printed > found.iqr[-1]:
        gives = f"{found.sds[-1]:g} mm per axis gives {found.iqr[-1]:.3g} only"
        return f"ours: even a landmark SD of {gives}"
    sd = _at(printed, found.iqr, found.sds)
    ends = " to ".join(f"{_at(printed, end, found.sds):.1f}" for end in (found.high, found.low))
    then = _origins_then(run, sd) if cells["quantity"] == "orientation" else ""
    gives = f"ours: a landmark SD of {sd:.1f} mm per axis ({ends}) gives {printed:g}"
    return f"{gives}{_own_sd(run)}{then}"


def _own_sd(run: StudyRun) -> str:
    """The study's own SD, where all landmarks have one."""
    try:
        own = np.unique(run.rows("landmarks")["sd_mm"].to_numpy(float))
    except NotComputed:
        return ""
    return f", the study's is {own[0]:g} mm" if len(own) == 1 else ""


def _origins_then(run: StudyRun, sd: float) -> str:
    """How far origins would scatter with the SD that an orientation asks for."""
    try:
        found = _spreads(run, quantity="origin", joint=JOINTS, coordinate=TRANSLATIONS)
    except NotComputed:
        return ""
    then = f"{_at(sd, found.sds, found.iqr):.1f} mm"
    return f"; origins then scatter by up to {then}, printed are {LARGEST_ORIGIN_IQR_MM:g} at most"


def _lowered(run: StudyRun, printed: float) -> tuple[float, float]:
    """How much lower the load must act for a flexion stiffness, mm, and the cost there over ours.

    Straight between the load points of the grid, as far forward as the study puts the load.
    """
    flexion = STIFFNESS["extension"]
    rows = run.rows("stiffness_over_load_point", anterior_shift_mm=0.0)
    rows = rows.dropna(subset=[flexion, "cost"]).sort_values("superior_shift_mm")
    values = rows[flexion].to_numpy(float)
    if len(values) < 2 or not values.min() <= printed <= values.max():
        raise NotComputed(
            "no height between the assumed one and that of the L1L2 origin has it, with the load "
            "as far forward as assumed"
        )
    if not (np.diff(values) > 0.0).all():
        raise NotComputed("flexion stiffness does not rise with the height of the load in this run")
    shifts, costs = rows["superior_shift_mm"].to_numpy(float), rows["cost"].to_numpy(float)
    shift = float(np.interp(printed, values, shifts))
    stated = float(np.interp(0.0, shifts, costs))
    return -shift, float(np.interp(shift, shifts, costs)) / stated


def lower_load(run: StudyRun, printed: float) -> Computed:
    """How much lower the load must act for a printed flexion stiffness, mm."""
    lower, cost = _lowered(run, printed)
    worth = "" if cost > 1.0 else ": motion does not speak against it"
    note = f"ours: the cost there is {cost:.2f} times that at the assumed height{worth}"
    return Computed(lower, note=note)


def flexion_stiffness(run: StudyRun, printed: float, **where: Any) -> Computed:
    """Median of the summary, with where the load would have to act for the printed one."""
    found = summary(run, "median", **where)
    try:
        lower, cost = _lowered(run, printed)
    except NotComputed:
        return found
    words = (
        f"ours: with the load {lower:.0f} mm lower the cohort's own poses have {printed:g} "
        f"N m/rad, at {cost:.2f} times the cost"
    )
    return replace(found, note=words)


# --- the best model -------------------------------------------------------------------------------


def _best(run: StudyRun) -> "pd.Series[Any]":
    """Row of the reduced fit of least cost."""
    kept = run.rows("success", reduced=True)["pose"]
    fits = run.rows("calibrations")
    fits = fits[fits["pose"].isin(kept)].dropna(subset=["cost"])
    if fits.empty:
        raise NotComputed("no fit is left in the reduced dataset")
    return fits.iloc[int(fits["cost"].to_numpy().argmin())]


def _motion(run: StudyRun, joints: tuple[str, ...], column: str) -> "pd.Series[float]":
    """Largest size of a column over readings, per joint, in the best model."""
    rows = run.rows("simulations", pose=int(_best(run)["pose"]), stiffness="calibrated")
    rows = rows[rows["joint"].isin(joints)]
    sizes = rows.assign(size=rows[column].abs()).groupby("joint")["size"].max().dropna()
    if sizes.empty:
        raise NotComputed(f"the best model has no {column} at {' or '.join(joints)}")
    return sizes


def best_stiffness(run: StudyRun, coordinate: str) -> Computed:
    """A stiffness of the best model."""
    best = _best(run)
    if best["joint"] != "*":
        raise NotComputed("stiffness is per joint in this study")
    return Computed(float(best[STIFFNESS[coordinate]]), note=f"pose {int(best['pose'])}")


def best_error(run: StudyRun, coordinate: str, joint: str = "") -> Computed:
    """Error of the best model at a joint, or the larger of two."""
    joints = (joint,) if joint else MEASURED_JOINTS
    return Computed(float(_motion(run, joints, f"error_{MOTION[coordinate]}").max()))


def best_error_percent(run: StudyRun, coordinate: str) -> Computed:
    """The larger share of the measured motion."""
    errors, sizes = (
        _motion(run, MEASURED_JOINTS, f"{what}_{MOTION[coordinate]}")
        for what in ("error", "measured")
    )
    shares = (100.0 * errors / sizes[sizes > 0.0]).dropna()
    if shares.empty:
        raise NotComputed(f"no {coordinate} motion was measured")
    return Computed(float(shares.max()))


def carried_force(run: StudyRun, joint: str) -> Computed:
    """Stiffness times superior motion of a joint in the best model, N."""
    stiffness = best_stiffness(run, "superior")
    motion = float(_motion(run, (joint,), "predicted_superior_mm").max())
    return Computed(stiffness.value * motion / 1000.0, note=stiffness.note)


# --- how many fits succeed ------------------------------------------------------------------------


def _rate(count: int, of: int) -> Computed:
    if of == 0:
        raise NotComputed("this run tried no such fit")
    low, high = wilson_percent(count, of)
    if of < FEWEST_OF_A_RATE:
        raise NotComputed(
            f"too few for a rate: {count} of {of} fits, 95 % interval {low:.0f} to {high:.0f} %; "
            f"at least {FEWEST_OF_A_RATE} are needed"
        )
    return Computed(100.0 * count / of, low, high, f"ours: {count} of {of}")


def successful(run: StudyRun, part: str, loading: str) -> Computed:
    """Solved and moved away from the start, outliers included, as the paper counts, percent."""
    row = run.row("counts", part=part, loading=loading)
    failed = int(row[f"near_start_{run.asked['failed_when']}"])
    return _rate(int(row["solved"]) - failed, int(row["fits"]))


def kept(run: StudyRun) -> Computed:
    """Poses in the reduced dataset, percent."""
    row = run.row("counts", part="poses", loading="equilibrium")
    return _rate(int(row["reduced"]), int(row["fits"]))


def successful_by(run: StudyRun, method: str) -> Computed:
    """The same of one way of fitting."""
    row = run.row("success_by_method", method=method)
    return _rate(int(row["successful"]), int(row["fits"]))


# --- how precise landmarks must be ----------------------------------------------------------------


def required_sd(run: StudyRun) -> Computed:
    """Largest landmark SD per axis that keeps the limits, mm; an end of the sampled ones else."""
    row = run.row("required_precision", stiffness="calibrated", motion="both")
    if pd.notna(row["sd_mm"]):
        ends = (row["sd_low_mm"], row["sd_high_mm"])
        low, high = (None if pd.isna(end) else float(end) for end in ends)
        note = f"ours: for {100.0 * row['share']:g} % of poses"
        return Computed(float(row["sd_mm"]), low, high, note)
    message = str(row["message"])
    sampled = run.rows("landmark_precision", stiffness="calibrated")["sd_mm"]
    if "will do" in message:
        return Computed(float(sampled.max()), note=f"ours is a lower end: {message}")
    if sampled.min() >= PER_AXIS_MM:
        raise NotComputed(message)
    return Computed(float(sampled.min()), note=f"ours is an upper end: {message}")


def share_below(run: StudyRun, motion: str, limit: float) -> Computed:
    """Poses with errors below a limit at the sampled SD nearest to the paper's, percent."""
    rows = run.rows("landmark_precision", stiffness="calibrated", motion=motion)
    row = rows.iloc[int((rows["sd_mm"] - PER_AXIS_MM).abs().to_numpy().argmin())]
    if row["limit"] != limit:
        raise NotComputed(f"this study's limit is {row['limit']:g}")
    share, low, high = (100.0 * float(row[n]) for n in ("below", "below_low", "below_high"))
    return Computed(share, low, high, f"ours: SD {row['sd_mm']:g} mm, {int(row['n'])} poses")


def midpoint_iqr(run: StudyRun) -> Computed:
    """IQR of a joint origin midway between two endplate centres, mm."""
    landmarks = run.rows("landmarks")
    centres = landmarks[landmarks["landmark"].str.contains("endplate")]["sd_mm"].unique()
    if len(centres) != 1:
        raise NotComputed("endplate centres have different SDs in this run, or none")
    sd = float(centres[0])
    return Computed(IQR_PER_SD * sd / sqrt(2.0), note=f"ours: {IQR_PER_SD:.3f} x {sd:g} / sqrt 2")


SELECTORS = significance.SELECTORS | named(
    *(summary, percent_of_median, ratio, percent_ratio, largest_shift, drop, share_lower),
    *(stiffness_range, start_over_damping, frame_spread, lower_load, flexion_stiffness),
    *(best_stiffness, best_error, best_error_percent, carried_force, successful, kept),
    *(successful_by, required_sd, share_below, midpoint_iqr),
)
