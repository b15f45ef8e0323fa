"""Job: what the load point does to each fitted stiffness, from the fits over the grid.

Where the load point has an SD, it is an input that no reading was taken of: the stiffness then has
the region of its fit at every point that it may have, each weighted by the prior (normal, cut off
at the ends of the grid) and by what the fit's cost says for the point, cost^(-d/2) with d degrees
of freedom (the likelihood with the scatter integrated out). A region counts as the 95 % of two
halves of a t distribution of the logarithm, one for each side, as regions of a stiffness are far
from symmetric. Between the points of the grid all of it is taken as straight.
"""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq
from scipy.stats import norm, t

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import LoadPoint
from spinepipe.studies.joint_pose_sensitivity.tables import LOAD_POINT_EFFECT
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS, STIFFNESS_UNITS

NODES = 31
"""Equally probable places of the load in each direction."""

AT = (0.025, 0.5, 0.975)
SHIFTS = ("anterior_shift_mm", "superior_shift_mm")

FARTHEST = 60.0
"""Of logarithms of stiffness: beyond any bound."""

TINY = 1e-12
"""mm2 and deg2: less is rounding, and costs are not told apart below it."""

LOST = 0.01
"""Share of the places without a fit from which on it is told."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``load_point_effect``."""
    settings, cohort = study_and_cohort(root, study)
    tried = read_frames(tables)["stiffness_over_load_point"]
    names = [name for name in COORDINATES if tried[f"{name}_identifiable"].notna().any()]
    rows = [
        {"specimen": specimen, "joint": joint, **effect(settings.load_point, part, name)}
        for (specimen, joint), part in tried.groupby(["specimen", "joint"], sort=False)
        for name in names
    ]
    made_by = provenance("load_point_effect", settings, cohort)
    write(from_rows(LOAD_POINT_EFFECT, rows), output, made_by)


def effect(asked: LoadPoint, part: pd.DataFrame, name: str) -> dict[str, Any]:
    """One row but for specimen and joint.

    Parameters
    ----------
    part : rows of one specimen and joint, one per load point. name : coordinate.
    """
    column = STIFFNESS_COLUMNS[COORDINATES.index(name)]
    unit = column.removeprefix(f"{name}_")
    usable = part[part["status"].isin(USABLE)]
    not_excluded = usable[usable["allowed"].ne(False)]
    stated = stated_of(part)
    relative = usable["cost"] / stated["cost"] if stated["cost"] else pd.Series(dtype=float)
    told = part["allowed"].dropna()
    return {
        "coordinate": name,
        "unit": STIFFNESS_UNITS[name],
        "stated": cell(stated[column]),
        "stated_low": cell(stated[f"{name}_low_{unit}"]),
        "stated_high": cell(stated[f"{name}_high_{unit}"]),
        "per_mm_anterior": slope(part, column, *SHIFTS),
        "per_mm_superior": slope(part, column, *SHIFTS[::-1]),
        "lowest": cell(not_excluded[column].min()),
        "highest": cell(not_excluded[column].max()),
        "cost_lowest": cell(relative.min()),
        "cost_highest": cell(relative.max()),
        "points": len(part),
        "fitted": len(usable),
        "allowed": int(told.sum()) if len(told) else None,
        "anterior_sd_mm": asked.anterior_sd_mm,
        "superior_sd_mm": asked.superior_sd_mm,
        **_uncertain(asked, part, name, unit),
    }


def cell(value: Any) -> float | None:
    """A number, or nothing."""
    return None if pd.isna(value) or not np.isfinite(value) else float(value)


def stated_of(part: pd.DataFrame) -> "pd.Series[Any]":
    """The row of the load point where the study puts it."""
    return part[(part[list(SHIFTS)] == 0.0).all(axis=1)].iloc[0]


def slope(part: pd.DataFrame, column: str, along: str, across: str) -> float | None:
    """Change per mm between the neighbours of 0 on both sides; of 0 and one where it is an end."""
    line = part[part[across] == 0.0].sort_values(along)
    shifts, values = line[along].to_numpy(float), line[column].to_numpy(float)
    at = int(np.flatnonzero(shifts == 0.0)[0])
    first, last = max(at - 1, 0), min(at + 1, len(shifts) - 1)
    if first == last:
        return None
    return cell((values[last] - values[first]) / (shifts[last] - shifts[first]))


def _uncertain(asked: LoadPoint, part: pd.DataFrame, name: str, unit: str) -> dict[str, Any]:
    """Median and 95 % range with the load point uncertain."""
    names = ("uncertain_low", "uncertain_median", "uncertain_high")
    nothing = {**dict.fromkeys(names), "message": ""}
    if not asked.uncertain:
        return nothing
    degrees = int(stated_of(part)["degrees_of_freedom"])
    if degrees < 1:
        return {**nothing, "message": "as many unknowns as readings: fits have no region"}
    ways = (
        _places(asked.anterior_sd_mm, asked.anterior_mm),
        _places(asked.superior_sd_mm, asked.superior_mm),
    )
    found, lost = _at(part, name, unit, degrees, np.array(list(product(*ways))))
    if found is None:
        return {**nothing, "message": "no stiffness was found near the load points"}
    ends = [cell(found.quantile(share)) for share in AT]
    told = "" if lost < LOST else f"no fit at {100.0 * lost:.0f} % of the places of the load"
    return {**dict(zip(names, ends, strict=True)), "message": told}


def _places(sd: float, grid: tuple[float, ...]) -> Array:
    """Equally probable places of a normal of this SD about 0, cut off where the grid ends."""
    if sd == 0.0:
        return np.zeros(1)
    # middles of slices of equal probability
    low, high = norm.cdf(np.array([grid[0], grid[-1]]) / sd)
    shares: Array = low + (high - low) * (np.arange(NODES) + 0.5) / NODES
    places: Array = sd * norm.ppf(shares)
    return places


@dataclass(frozen=True)
class Mixture:
    """A mixture of regions of the logarithm of a stiffness, each two halves of a t distribution.

    Attributes
    ----------
    weights : (P,) that sum to one. middle : (P,) fitted logarithms.
    below, above : (P,) per unit of the logarithm, the t distribution's argument on either side; 0
        where the region is open.
    """

    weights: Array
    middle: Array
    below: Array
    above: Array
    degrees: int

    def share_below(self, x: float) -> float:
        """Share of the mixture below a logarithm."""
        off = x - self.middle
        per = np.where(off < 0.0, self.below, self.above)
        return float(self.weights @ t.cdf(per * off, self.degrees))

    def quantile(self, share: float) -> float:
        """The stiffness below which so much lies; NaN where that is open."""
        # the share below rises with the logarithm: one root, found by Brent's method
        ends = self.middle.min() - FARTHEST, self.middle.max() + FARTHEST
        if self.share_below(ends[0]) >= share or self.share_below(ends[1]) <= share:
            return float("nan")
        return float(np.exp(brentq(lambda x: self.share_below(x) - share, *ends)))


def _at(
    part: pd.DataFrame, name: str, unit: str, degrees: int, places: Array
) -> tuple[Mixture | None, float]:
    """The fits at equally probable places (P, 2) of the load, mm, and the share of these lost.

    Lost is what lies beside a point of the grid without a fit.
    """
    here = part.sort_values(list(SHIFTS))
    value, low, high = (
        np.log(here[column].to_numpy(float))
        for column in (f"{name}_{unit}", f"{name}_low_{unit}", f"{name}_high_{unit}")
    )
    # a region's end lies where the t distribution's argument is its 97.5 % point
    limit = float(t.ppf(AT[-1], degrees))
    below, above = limit / (value - low), limit / (high - value)
    usable = here["status"].isin(USABLE).to_numpy()
    cost = np.log(np.maximum(here["cost"].to_numpy(float), TINY))
    numbers = np.array([value, np.nan_to_num(below), np.nan_to_num(above), cost])
    numbers[:, ~usable] = np.nan
    at = _between(here, numbers, places)
    there = np.isfinite(at).all(axis=0)
    if not there.any():
        return None, 1.0
    middle, below, above, cost = at[:, there]
    weights = np.full(len(places), 1.0 / len(places))
    # likelihood of the place with the scatter integrated out: cost^(-d/2)
    fitting = weights[there] * np.exp(-0.5 * degrees * (cost - cost.min()))
    lost = 1.0 - float(weights[there].sum())
    return Mixture(fitting / fitting.sum(), middle, below, above, degrees), lost


def _between(here: pd.DataFrame, numbers: Array, places: Array) -> Array:
    """(4, P) at places (P, 2), mm, straight between numbers (4, N) at the points of a grid."""
    levels = [np.unique(here[shift].to_numpy(float)) for shift in SHIFTS]
    shape = tuple(len(level) for level in levels)
    used = [way for way in (0, 1) if shape[way] > 1]
    if not used:
        return np.repeat(numbers, len(places), axis=1)
    grid = numbers.T.reshape(*(shape[way] for way in used), len(numbers))
    straight = RegularGridInterpolator([levels[way] for way in used], grid)
    found: Array = straight(places[:, used]).T
    return found
