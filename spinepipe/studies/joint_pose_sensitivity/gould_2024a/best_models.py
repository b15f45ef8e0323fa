"""The one best pose: its stiffness and errors, section 3.3."""

from collections.abc import Callable, Iterator
from typing import Any

import pandas as pd

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    MOTION_UNIT,
    NO_RAW_DATA,
    PAPER,
    STIFFNESS_KEY,
    STIFFNESS_UNIT,
    measured,
)
from spinepipe.comparison.ranges import factor_of_two, no_larger, within_width
from spinepipe.comparison.run import NotComputed, Run

_BEST = PAPER["best_model"]
_CALIBRATED = "calibrated"


def claims() -> Iterator[Claim]:
    """Stiffness and largest errors of the best model."""
    for name in FITTED:
        paper = float(_BEST["stiffness"][STIFFNESS_KEY[name]])
        spread = float(PAPER["ten_best_stiffness"]["range"][STIFFNESS_KEY[name]])
        yield Claim(
            f"best_model.stiffness.{name}", "section 3.3", f"{name} stiffness of the best model",
            STIFFNESS_UNIT[name], paper, within_width(paper, spread, "range over the ten best"),
            _stiffness(name), NO_RAW_DATA,
        )  # fmt: skip
    for name in FITTED:
        paper = float(_BEST["largest_error"][MOTION_KEY[name]])
        yield Claim(
            f"best_model.error.{name}", "section 3.3",
            f"{name} error of the best model, larger of two joints", MOTION_UNIT[name], paper,
            no_larger(paper), _error(name, MEASURED_JOINTS), NO_RAW_DATA,
        )  # fmt: skip
    yield from _percents()


def _percents() -> Iterator[Claim]:
    for name in FITTED:
        paper = float(_BEST["largest_error_percent"][name])
        yield Claim(
            f"best_model.error_percent.{name}", "section 3.3",
            f"{name} error of the best model, larger share of two joints", "% of measured", paper,
            factor_of_two(paper), _percent(name), NO_RAW_DATA,
            note="" if name == "anterior" else "of the motion in the best model's own joint frames",
            contradicted=_shear_motion(paper) if name == "anterior" else "",
        )  # fmt: skip
    share = float(PAPER["best_model"]["superior_error_of_L2L3"]["error_mm"])
    yield Claim(
        "best_model.error.superior.L2L3", "section 3.3", "superior error of the best model at L2L3",
        "mm", share, no_larger(share), _error("superior", ("L2L3",)), NO_RAW_DATA,
    )  # fmt: skip


def _shear_motion(percent: float) -> str:
    error = float(_BEST["largest_error"]["anterior_mm"])
    nominal = max(measured(joint, "anterior") for joint in MEASURED_JOINTS)
    return (
        f"A17: {error:g} mm are {percent:g} % of {100.0 * error / percent:.2f} mm, "
        f"but the printed motion is {nominal:g} mm"
    )


def _pose(run: Run) -> "pd.Series[Any]":
    """Row of the reduced fit of least cost."""
    kept = run.rows("success", reduced=True)["pose"]
    fits = run.rows("calibrations")
    fits = fits[fits["pose"].isin(kept)].dropna(subset=["cost"])
    if fits.empty:
        raise NotComputed("no fit is left in the reduced dataset")
    return fits.iloc[int(fits["cost"].to_numpy().argmin())]


def _stiffness(name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        best = _pose(run)
        if best["joint"] != "*":
            raise NotComputed("stiffness is per joint in this study")
        return Ours(float(best[STIFFNESS_KEY[name]]), note=f"pose {int(best['pose'])}")

    return ours


def _motion(run: Run, joints: tuple[str, ...], column: str) -> "pd.Series[float]":
    """Largest size of a column over readings, per joint, in the best model."""
    pose = int(_pose(run)["pose"])
    rows = run.rows("simulations", pose=pose, stiffness=_CALIBRATED)
    rows = rows[rows["joint"].isin(joints)]
    sizes = rows.assign(size=rows[column].abs()).groupby("joint")["size"].max().dropna()
    if sizes.empty:
        raise NotComputed(f"the best model has no {column} at {' or '.join(joints)}")
    return sizes


def _error(name: str, joints: tuple[str, ...]) -> Callable[[Run], Ours]:
    return lambda run: Ours(float(_motion(run, joints, f"error_{MOTION_KEY[name]}").max()))


def _percent(name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        errors = _motion(run, MEASURED_JOINTS, f"error_{MOTION_KEY[name]}")
        sizes = _motion(run, MEASURED_JOINTS, f"measured_{MOTION_KEY[name]}")
        shares = (100.0 * errors / sizes[sizes > 0.0]).dropna()
        if shares.empty:
            raise NotComputed(f"no {name} motion was measured")
        return Ours(float(shares.max()))

    return ours


def carried_force(joint: str) -> Callable[[Run], Ours]:
    """Stiffness times superior motion of a joint in the best model, N."""

    def ours(run: Run) -> Ours:
        stiffness = _stiffness("superior")(run)
        motion = float(_motion(run, (joint,), "predicted_superior_mm").max())
        return Ours(stiffness.value * motion / 1000.0, note=stiffness.note)

    return ours
