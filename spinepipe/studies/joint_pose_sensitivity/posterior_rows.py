"""Rows of a posterior's tables: what is told of a quantity's draws, and of predicted motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.special import ndtri

from spinepipe.calibration import Problem
from spinepipe.calibration.posterior import ResidualNoise, between
from spinepipe.calibration.solvers import CaseResiduals
from spinepipe.effects.contract import Array
from spinepipe.model import MeasuredCase
from spinepipe.status import Status
from spinepipe.units import (
    COORDINATE_UNITS,
    COORDINATES,
    DISPLAY_PER_SI,
    STIFFNESS_COLUMNS,
    STIFFNESS_UNITS,
    TRANSLATIONS,
    subtract_baseline,
)

ENDS = (2.5, 97.5)
"""Percent of draws below either end of a 95 % interval."""

LITTLE_TOLD = 0.9
"""A posterior whose SD is more than this share of the prior's is the prior's, not the data's."""

NEAR_BOUND = 0.05
"""Share of the prior's range that counts as beside a bound."""

OPEN = 0.5 * NEAR_BOUND
"""Share of draws there at which the bound decides, not the data: half of what the prior puts."""

PREDICTIONS = ("median", "low", "high", "reading_low", "reading_high", "inside")
"""Columns of predicted motion that are made of draws."""

_MIDS = (np.arange(1000) + 0.5) / 1000.0
"""Shares of a distribution at which a function of a normal number is averaged."""


@dataclass(frozen=True)
class PosteriorQuantity:
    """A number that the posterior tells of.

    Attributes
    ----------
    place : what the row is called. unit : of the numbers.
    draws : (C, D). near : values at `_MIDS` of the normal density at the mode.
    share : posterior SD as a share of the prior's. open : below and above, see `OPEN`.
    """

    place: dict[str, str]
    unit: str
    draws: Array
    near: Array
    share: float
    open: tuple[bool, bool] | None

    @classmethod
    def stiffness(
        cls,
        where: tuple[str, str],
        z: Array,
        near: tuple[float, float],
        bounds: tuple[float, float],
        start: float,
    ) -> Self:
        """A stiffness of the joint and column ``where``; ``bounds`` of its logarithm over start."""
        low, high = (np.array([bound]) for bound in bounds)

        def values(numbers: Array) -> Array:
            found: Array = start * np.exp(between(low, high, numbers[..., None])[0][..., 0])
            return found

        joint, column = where
        place = {"quantity": "stiffness", "joint": joint, "unknown": column}
        edge = float(-ndtri(NEAR_BOUND))  # z is standard normal where the prior is uniform
        beside = (bool(np.mean(z < -edge) >= OPEN), bool(np.mean(z > edge) >= OPEN))
        unit = STIFFNESS_UNITS[COORDINATES[STIFFNESS_COLUMNS.index(column)]]
        normal = near[0] + near[1] * ndtri(_MIDS)
        return cls(place, unit, values(z), values(normal), float(z.std()), beside)

    @classmethod
    def landmark(
        cls, names: tuple[str, str], axis: str, z: Array, near: tuple[float, float], sd_mm: float
    ) -> Self:
        """How far a landmark lies from where it was felt, along an axis of ground."""
        vertebra, mark = names
        place = {"quantity": "landmark", "joint": vertebra, "unknown": f"{mark}_{axis}"}
        normal = near[0] + near[1] * ndtri(_MIDS)
        return cls(place, "mm", z * sd_mm, normal * sd_mm, float(z.std()), None)

    @classmethod
    def joint(
        cls, name: str, axis: int, draws: Array, near: tuple[float, float], prior: float
    ) -> Self:
        """Offset of a joint's centre or tilt of its axes, number ``axis`` of six; SI."""
        coordinate, scale = COORDINATES[axis], float(DISPLAY_PER_SI[axis])
        kind = "joint_centre" if coordinate in TRANSLATIONS else "joint_axes"
        place = {"quantity": kind, "joint": name, "unknown": coordinate}
        normal = (near[0] + near[1] * ndtri(_MIDS)) * scale
        share = float(draws.std()) / prior
        return cls(place, COORDINATE_UNITS[coordinate], draws * scale, normal, share, None)


def posterior_row(
    quantity: PosteriorQuantity, r_hat: float, ess_bulk: float, ess_tail: float, *, believed: bool
) -> dict[str, Any]:
    """What is told of a quantity, but for specimen and status; draws only where ``believed``."""
    draws = quantity.draws.ravel()
    low, median, high = np.percentile(draws, [ENDS[0], 50.0, ENDS[1]]).tolist()
    near_low, near_high = np.percentile(quantity.near, ENDS).tolist()
    below, above = quantity.open or (None, None)
    drawn: dict[str, Any] = {
        "mean": float(draws.mean()),
        "sd": float(draws.std(ddof=1)),
        "median": median,
        "low": low,
        "high": high,
        "sd_over_prior": quantity.share,
        "prior_dominated": quantity.share > LITTLE_TOLD,
        "open_below": below,
        "open_above": above,
    }
    return {
        **quantity.place,
        "unit": quantity.unit,
        **(drawn if believed else dict.fromkeys(drawn)),
        "laplace_mean": float(quantity.near.mean()),
        "laplace_sd": float(quantity.near.std()),
        "laplace_low": near_low,
        "laplace_high": near_high,
        "r_hat": r_hat,
        "ess_bulk": ess_bulk,
        "ess_tail": ess_tail,
    }


def prior_row(names: tuple[str, str], axis: str, sd_mm: float) -> dict[str, Any]:
    """Of a landmark that moves no joint, or that is certain: its posterior is its prior."""
    vertebra, mark = names
    reach = float(ndtri(ENDS[1] / 100.0)) * sd_mm
    told = "moves no joint: the posterior is the prior" if sd_mm else "taken as certain: no SD"
    numbers = {"mean": 0.0, "sd": sd_mm, "median": 0.0, "low": -reach, "high": reach}
    near = {"mean": 0.0, "sd": sd_mm, "low": -reach, "high": reach}
    return {
        "quantity": "landmark",
        "joint": vertebra,
        "unknown": f"{mark}_{axis}",
        "unit": "mm",
        **numbers,
        **{f"laplace_{name}": value for name, value in near.items()},
        "sd_over_prior": 1.0,
        "prior_dominated": True,
        "status": Status.CONVERGED.value,
        "message": told,
    }


def refused_row(message: str) -> dict[str, Any]:
    """The only row of a specimen without a posterior."""
    place = {"quantity": "stiffness", "joint": "*", "unknown": "*", "unit": ""}
    return {**place, "status": Status.REFUSED.value, "message": message}


def motion_rows(
    problem: Problem, seen: Sequence[CaseResiduals], noise: ResidualNoise, seed: int
) -> list[dict[str, Any]]:
    """Bands of the motion, and of a new reading of it, beside what was measured."""
    rng = np.random.default_rng(seed)
    scale = np.sqrt(problem.weights) * DISPLAY_PER_SI
    # residuals are weighted: an SD of a reading is that of its residual over the root of its weight
    with np.errstate(divide="ignore", invalid="ignore"):
        sd = np.where(scale > 0.0, np.sqrt(noise.variance) / scale, np.nan)
    rows: list[dict[str, Any]] = []
    for number, case in enumerate(problem.cases):
        motion = np.stack([subtract_baseline(one.readings[number], case.zeroed) for one in seen])
        # a new reading has an error of its own and, where the case is zeroed, that of step 0
        read = motion + subtract_baseline(
            np.moveaxis(sd * rng.standard_normal(motion.shape), 0, 1), case.zeroed
        ).swapaxes(0, 1)
        rows += _case_rows(problem, case, motion, read)
    return rows


def _case_rows(
    problem: Problem, case: MeasuredCase, motion: Array, read: Array
) -> list[dict[str, Any]]:
    """Of one cycle: motion (S, T, J, 6) m and rad, and readings of it, NaN where none is made."""
    bands = np.percentile(motion, [ENDS[0], 50.0, ENDS[1]], axis=0) * DISPLAY_PER_SI
    rows = []
    measured = case.readings * DISPLAY_PER_SI
    for step, joint, axis in np.ndindex(*measured.shape):
        value, new = measured[step, joint, axis], read[:, step, joint, axis]
        ends: tuple[float | None, float | None] = (None, None)
        if np.isfinite(new).all():
            low, high = np.percentile(new * DISPLAY_PER_SI[axis], ENDS).tolist()
            ends = (low, high)
        known = bool(np.isfinite(value))
        inside = None
        if known and ends[0] is not None and ends[1] is not None:
            inside = bool(ends[0] <= value <= ends[1])
        low, median, high = bands[:, step, joint, axis].tolist()
        rows.append(
            {
                "test": case.case.test,
                "cycle": case.case.cycle,
                "step": case.case.steps[step].step,
                "joint": problem.model.joints[joint],
                "coordinate": COORDINATES[axis],
                "unit": COORDINATE_UNITS[COORDINATES[axis]],
                "measured": float(value) if known else None,
                "median": median,
                "low": low,
                "high": high,
                "reading_low": ends[0],
                "reading_high": ends[1],
                "inside": inside,
                "draws": len(motion),
            }
        )
    return rows
