"""What had to be assumed of the paper, and what it does: the landmarks' SD and the load point.

Neither is published (docs/decisions/0001). So beside a number that hangs on one of them stands what
the assumption would have to be for the printed number, read off fits and frames made with others.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    JOINTS,
    PAPER,
    STIFFNESS_KEY,
)
from spinepipe.units import STIFFNESS_UNITS, TRANSLATIONS

FLEXION = STIFFNESS_KEY["extension"]

PUBLISHED = {
    "median": ("section 3.3, Fig 8", float(PAPER["reduced_stiffness"]["median"][FLEXION])),
    "best_model": ("section 3.2, Table 4", float(PAPER["best_model"]["stiffness"][FLEXION])),
}
"""Printed flexion stiffness, where it stands and its value."""

LOWEST_MM = 50.0
"""From the assumed load point down to the height of the L1L2 origin."""

_NO_POINT = (
    "no height between the assumed one and that of the L1L2 origin has it, with the load as far "
    "forward as assumed"
)

Cell = tuple[str, str, str]
"""Joint, quantity and coordinate of a spread."""


def with_sd(
    ours: Callable[[Run], Ours], printed: float, cells: Iterable[Cell]
) -> Callable[..., Ours]:
    """The same value, with the landmark SD that has the printed spread.

    Parameters
    ----------
    printed : interquartile range, mm or deg. cells : of which the largest is compared.
    """
    every = tuple(cells)

    def told(run: Run) -> Ours:
        found = ours(run)
        return replace(found, note="; ".join(filter(None, (found.note, _sd(run, printed, every)))))

    return told


def _sd(run: Run, printed: float, cells: tuple[Cell, ...]) -> str:
    """``ours: a landmark SD of 2.2 mm (2.0 to 2.5) per axis ...``; nothing without the table."""
    try:
        found = spreads(run, cells)
    except NotComputed:
        return ""
    if printed > found.iqr[-1]:
        least = (
            f"even a landmark SD of {found.sds[-1]:g} mm per axis gives {found.iqr[-1]:.3g} only"
        )
        return f"ours: {least}"
    sd = _at(printed, found.iqr, found.sds)
    ends = " to ".join(f"{_at(printed, end, found.sds):.1f}" for end in (found.high, found.low))
    then = _origins_then(run, sd) if cells[0][1] == "orientation" else ""
    gives = f"ours: a landmark SD of {sd:.1f} mm per axis ({ends}) gives {printed:g}"
    return f"{gives}{_own_sd(run)}{then}"


def _at(x: float, xs: np.ndarray, ys: np.ndarray) -> float:
    """Straight between points and from 0, 0."""
    return float(np.interp(x, np.r_[0.0, xs], np.r_[0.0, ys]))


def _origins_then(run: Run, sd: float) -> str:
    """How far origins would scatter with the SD that an orientation asks for."""
    printed = PAPER["joint_origin"]["complete"]
    largest = max(float(iqr) for joint in JOINTS for iqr in printed[joint]["iqr"].values())
    try:
        found = spreads(run, [(j, "origin", name) for j in JOINTS for name in TRANSLATIONS])
    except NotComputed:
        return ""
    then = _at(sd, found.sds, found.iqr)
    return f"; origins then scatter by up to {then:.1f} mm, printed are {largest:g} at most"


@dataclass(frozen=True)
class Spreads:
    """Landmark SDs, mm, rising; at each the largest interquartile range of some cells, its ends."""

    sds: np.ndarray
    iqr: np.ndarray
    low: np.ndarray
    high: np.ndarray


def spreads(run: Run, cells: Iterable[Cell]) -> Spreads:
    """The ranges of these cells, the largest of them at each SD.

    Raises
    ------
    NotComputed
        Where the run has no such table.
    """
    parts = []
    for joint, quantity, name in cells:
        where = {"joint": joint, "quantity": quantity, "coordinate": name}
        parts.append(run.rows("spread_over_landmark_sd", **where))
    known = pd.concat(parts).dropna(subset=["iqr"])
    if known.empty:
        raise NotComputed("no landmark set defines a frame")
    largest = known.groupby("sd_mm")[["iqr", "iqr_low", "iqr_high"]].max().cummax()
    columns = (largest[name].to_numpy(float) for name in largest)
    return Spreads(largest.index.to_numpy(float), *columns)


def _own_sd(run: Run) -> str:
    """The study's own SD, where all landmarks have one."""
    try:
        own = np.unique(run.rows("landmarks")["sd_mm"].to_numpy(float))
    except NotComputed:
        return ""
    return f", the study's is {own[0]:g} mm" if len(own) == 1 else ""


def with_load_point(ours: Callable[[Run], Ours], printed: float) -> Callable[[Run], Ours]:
    """The same value, with where the load would have to act for the printed flexion stiffness."""

    def told(run: Run) -> Ours:
        found = ours(run)
        try:
            lower, cost = lowered(run, printed)
        except NotComputed:
            return found
        words = (
            f"ours: with the load {lower:.0f} mm lower the cohort's own poses have {printed:g} "
            f"{STIFFNESS_UNITS['extension']}, at {cost:.2f} times the cost"
        )
        return replace(found, note="; ".join(filter(None, (found.note, words))))

    return told


def lowered(run: Run, stiffness: float) -> tuple[float, float]:
    """How much lower the load must act for a flexion stiffness, mm, and the cost there over ours.

    Straight between the load points of the grid, as far forward as the study puts the load.

    Raises
    ------
    NotComputed
        Where no such point of the grid has it.
    """
    rows = run.rows("stiffness_over_load_point", anterior_shift_mm=0.0)
    rows = rows.dropna(subset=[FLEXION, "cost"]).sort_values("superior_shift_mm")
    values = rows[FLEXION].to_numpy(float)
    if len(values) < 2 or not values.min() <= stiffness <= values.max():
        raise NotComputed(_NO_POINT)
    if not (np.diff(values) > 0.0).all():
        raise NotComputed("flexion stiffness does not rise with the height of the load in this run")
    shifts, costs = rows["superior_shift_mm"].to_numpy(float), rows["cost"].to_numpy(float)
    shift = float(np.interp(stiffness, values, shifts))
    stated = float(np.interp(0.0, shifts, costs))
    return -shift, float(np.interp(shift, shifts, costs)) / stated


def claims_of_load_point() -> Iterator[Claim]:
    """Whether a lower load, where the paper leaves it open, has the printed flexion stiffness."""
    for key, (where, printed) in PUBLISHED.items():
        yield Claim(
            f"load_point.lower_for_{key}",
            where,
            f"lowering of the load at which the cohort's own poses have the paper's {printed:g} "
            f"{STIFFNESS_UNITS['extension']} in flexion",
            "mm",
            None,
            Range(
                0.0,
                LOWEST_MM,
                "from the assumed height, 50 mm above the L1L2 origin, down to that origin: the "
                "paper prints no height of the load",
            ),
            _lower(printed),
            _NO_POINT,
            "whether the assumption explains the difference, not a number of the paper",
        )


def _lower(printed: float) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        lower, cost = lowered(run, printed)
        worth = "" if cost > 1.0 else ": motion does not speak against it"
        return Ours(
            lower,
            note=f"ours: the cost there is {cost:.2f} times that at the assumed height{worth}",
        )

    return ours
