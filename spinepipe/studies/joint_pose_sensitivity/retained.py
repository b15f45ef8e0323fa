"""The one data set of the page: what retained fits say of each stiffness, in the field's units."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import norm

from spinepipe.cohort import Cohort
from spinepipe.designs import specimen_seed
from spinepipe.report.words import AXIS, level
from spinepipe.studies.joint_pose_sensitivity.filters import judge_bootstrap
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.spread import iqr_with_ends
from spinepipe.studies.joint_pose_sensitivity.tables import region_columns
from spinepipe.units import (
    COORDINATES,
    DEG_PER_RAD,
    MM_PER_M,
    ROTATIONS,
    STIFFNESS_COLUMNS,
    TRANSLATIONS,
)

MOST_LOST = 0.5
"""Of the fits: a stiffness that more of them do not identify has no number."""

MOST_AT_BOUND = 0.1
"""Of the fits: where more stand at a bound, quartiles may be made of it."""

FEWEST = 3
"""Retained fits below which quartiles say nothing of a spread."""

AT_BOUND = 1e-4
"""Relative distance below which a stiffness stands at its bound."""

MIDDLE_HALF = 2.0 * float(norm.ppf(0.75))
"""Width of the middle half of a normal distribution, in SDs."""

EVERY_JOINT = "*"
REST = "equilibrium"
"""Loading under which motion is read at rest, as by the fits of palpations."""

READ = {REST: "at rest", "quasi_static": "quasi-statically", "dynamic": "on a load ramp"}
"""When motion is read under each loading."""

UNIT = {name: "N/mm" if name in TRANSLATIONS else "N m/deg" for name in COORDINATES}
FACTOR = {n: 1.0 / (MM_PER_M if n in TRANSLATIONS else DEG_PER_RAD) for n in COORDINATES}
"""From N/m and N m/rad, as tables have them."""

COLUMN = dict(zip(COORDINATES, STIFFNESS_COLUMNS, strict=True))
Array = NDArray[np.float64]


def place_of(specimen: str, joint: str, cohort: Cohort) -> str:
    """Whose a stiffness is: ``s02 L3–L4``; nothing where there is one specimen and one joint."""
    words = [specimen] if len(cohort.specimen_names) > 1 else []
    return " ".join([*words, level(joint)] if joint != EVERY_JOINT else words)


@dataclass(frozen=True, eq=False)
class RetainedStiffness:
    """One stiffness of a specimen, or of one of its joints, over the retained fits.

    Attributes
    ----------
    place : whose it is, see `place_of`.
    values : (n,) in `unit`. bounds : between which they were fitted.
    lost : how many fits do not identify it.
    region : median ends of the fits' 95 % regions; None where those of most fits are open.
    seed : of the bootstrap.
    """

    specimen: str
    joint: str
    coordinate: str
    place: str
    values: Array
    bounds: tuple[float, float]
    lost: int
    region: tuple[float | None, float | None]
    seed: int

    @property
    def unit(self) -> str:
        """N/mm or N m/deg."""
        return UNIT[self.coordinate]

    @property
    def name(self) -> str:
        """As a sentence has it."""
        return named(self.coordinate, self.place)

    @property
    def told(self) -> bool:
        """Whether it has a number: most fits identify it, and few stand at a bound."""
        n = len(self.values)
        return n >= FEWEST and not self.open and self.at_bound <= MOST_AT_BOUND * n

    @property
    def open(self) -> bool:
        """Whether most fits do not identify it."""
        return self.lost > MOST_LOST * len(self.values)

    @property
    def at_bound(self) -> int:
        """How many fits stand at a bound of it."""
        return int(self._at_bound(self.values).sum())

    def at(self, *percents: float) -> Array:
        """Percentiles over the fits; NaN of one that is at a bound."""
        found: Array = np.percentile(self.values, percents)
        return np.where(self._at_bound(found), np.nan, found)

    def _at_bound(self, values: Array) -> Any:
        return np.any([np.isclose(values, bound, AT_BOUND, 0.0) for bound in self.bounds], axis=0)

    @cached_property
    def moved(self) -> tuple[float, float, float]:
        """Middle half as a share of the median, %, with its 95 % interval (bootstrap over fits)."""
        found = iqr_with_ends(self.values, specimen_seed(self.seed, f"moved/{self.name}"))
        share, low, high = (100.0 * float(one) / float(self.at(50.0)[0]) for one in found)
        return share, low, high


def named(coordinate: str, place: str = "") -> str:
    """``flexion–extension stiffness of s02 L3–L4``."""
    whose = f" of {place}" if place else ""
    return f"{AXIS[coordinate].lower()} stiffness{whose}"


def retained(rows: pd.DataFrame, success: pd.DataFrame) -> pd.DataFrame:
    """Rows of the poses whose fit the filters of the study keep.

    Parameters
    ----------
    rows : of any table with specimen and pose. success : see `filters`.
    """
    if rows.empty or success.empty:
        return rows.iloc[:0]
    kept = success.loc[success["reduced"].astype(bool), ["specimen", "pose"]]
    return rows.merge(kept, on=["specimen", "pose"])


def stiffnesses(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> list[RetainedStiffness]:
    """Every fitted stiffness: by coordinate, specimen, and joint from above.

    Parameters
    ----------
    tables : calibrations and success.
    """
    nothing = pd.DataFrame()
    fits = retained(tables.get("calibrations", nothing), tables.get("success", nothing))
    joints = (EVERY_JOINT, *reversed(cohort.joint_names))
    return [
        _of(study, cohort, rows, name)
        for name in COORDINATES
        if name in study.calibration.free
        for specimen in cohort.specimen_names
        for joint in joints
        if len(fits)
        and len(rows := fits[(fits["specimen"] == specimen) & (fits["joint"] == joint)])
    ]


def _of(
    study: JointPoseSensitivity, cohort: Cohort, rows: pd.DataFrame, name: str
) -> RetainedStiffness:
    factor, wide = FACTOR[name], study.calibration.bound_factor
    start = factor * study.stiffness.in_order()[COORDINATES.index(name)]
    _, low, high, below, above, identifiable = region_columns(name)
    specimen, joint = rows[["specimen", "joint"]].iloc[0]
    values = factor * rows[COLUMN[name]].to_numpy(float)
    return RetainedStiffness(
        specimen=specimen,
        joint=joint,
        coordinate=name,
        place=place_of(specimen, joint, cohort),
        values=values[np.isfinite(values)],
        bounds=(start / wide, start * wide),
        lost=int(rows[identifiable].ne(True).sum()),
        region=(
            _end(factor * rows[low], rows[below], 0.0),
            _end(factor * rows[high], rows[above], np.inf),
        ),
        seed=study.seed,
    )


def _end(ends: pd.Series, is_open: pd.Series, beyond: float) -> float | None:
    """Median of the ends, open ones taken as far beyond; None where it is one of these."""
    known = np.where(is_open.eq(True), beyond, ends.to_numpy(float))
    known = known[~np.isnan(known)]
    middle = float(np.median(known)) if len(known) else beyond
    return None if middle == beyond else middle


def most_moved(found: list[RetainedStiffness]) -> RetainedStiffness | None:
    """The stiffness that the answer tells: of the first coordinate with a number, the one that
    palpation moves most. Rotations come first, in which spines are compared.
    """
    for name in (*ROTATIONS, *TRANSLATIONS):
        told = [one for one in found if one.coordinate == name and one.told]
        if told:
            return max(told, key=lambda one: one.moved[0])
    return None


def moved_by_load(effect: pd.Series) -> float | None:
    """Middle half of a stiffness as the load's place has its SDs, % of the stiffness.

    To first order, by the change per mm each way. None where no SD was stated, or where the fit
    with the load at the stated place does not identify the stiffness.

    Parameters
    ----------
    effect : a row of the table ``load_point_effect``.
    """
    if effect[["stated", "stated_low", "stated_high"]].isna().any():
        return None
    ways = [way for way in ("anterior", "superior") if effect[f"{way}_sd_mm"] > 0.0]
    sds = [float(effect[f"per_mm_{way}"]) * float(effect[f"{way}_sd_mm"]) for way in ways]
    moved = 100.0 * MIDDLE_HALF * float(np.linalg.norm(sds)) / float(effect["stated"])
    return moved if ways and np.isfinite(moved) else None


def effect_on(one: RetainedStiffness, effects: pd.DataFrame) -> pd.Series | None:
    """The row of ``load_point_effect`` of the same stiffness, where there is one with a fit."""
    if effects.empty:
        return None
    same = (
        effects[["specimen", "joint", "coordinate"]] == [one.specimen, one.joint, one.coordinate]
    ).all(axis=1)
    rows = effects[same & effects["stated"].notna()]
    return None if rows.empty else rows.iloc[0]


def percentiles(values: Array, *percents: float) -> Array:
    """Percentiles of values of which some may be infinite; NaN of what one of these makes."""
    with np.errstate(invalid="ignore"):
        found: Array = np.percentile(values, percents)
    return np.where(np.isfinite(found), found, np.nan)


def other_fits(
    study: JointPoseSensitivity, fits: pd.DataFrame, one: RetainedStiffness
) -> dict[tuple[str, str], Array]:
    """A stiffness of retained fits from other starts and with other damping.

    By what was drawn and loading, over the median from other starts at rest (of all, where none
    was at rest). A value at a bound is infinitely far out.

    Parameters
    ----------
    fits : the table ``bootstrap``.
    """
    if fits.empty:
        return {}
    keys = ["specimen", "bootstrap", "loading", "set"]
    judged = judge_bootstrap(study, fits)
    own = fits.merge(judged.loc[judged["reduced"], keys], on=keys)
    own = own[own["specimen"] == one.specimen]
    own = own if one.joint == EVERY_JOINT else own[own["joint"] == one.joint]
    own = own.drop_duplicates(keys)
    column, wide = COLUMN[one.coordinate], study.calibration.bound_factor
    values, start = (own[name].to_numpy(float) for name in (column, f"start_{column}"))
    values = np.where(np.isclose(values, start * wide, AT_BOUND, 0.0), np.inf, values)
    values = np.where(np.isclose(values, start / wide, AT_BOUND, 0.0), -np.inf, values)
    rest = ((own["bootstrap"] == "start") & (own["loading"] == REST)).to_numpy()
    middle = np.median(values[rest] if rest.any() else values) if len(values) else 1.0
    return {
        (str(what), str(loading)): values[own.index.get_indexer(part.index)] / middle
        for (what, loading), part in own.groupby(["bootstrap", "loading"], sort=False)
    }
