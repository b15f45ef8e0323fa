"""The best models: the ten best poses (Table 4) and the one best of section 3.3."""

from collections.abc import Callable, Iterator
from typing import Any

import pandas as pd

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    exactly,
    factor_of_two,
    no_larger,
    within_width,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    NO_RAW_DATA,
    PAPER,
    STIFFNESS_KEY,
    measured,
    summary_cell,
    summary_largest,
    summary_median,
    summary_percent,
)
from spinepipe.units import COORDINATE_UNITS, STIFFNESS_UNITS

_BEST = PAPER["best_model"]
_CALIBRATED = "calibrated"
BEST = {"part": "poses", "loading": "equilibrium", "dataset": "best"}

_RANKED = "the best are ranked by cost here; the paper does not say by which error"


def claims_of_ten_best() -> Iterator[Claim]:
    """Cells of Table 4, ratios of section 3.3, the summary of section 4."""
    for name in FITTED:
        for joint in MEASURED_JOINTS:
            where = {**BEST, "quantity": "error", "joint": joint, "coordinate": name}
            printed = PAPER["ten_best_error"][joint]
            numbers = {kind: float(printed[kind][MOTION_KEY[name]]) for kind in printed}
            words, unit = f"{name} error at {joint}", COORDINATE_UNITS[name]
            yield from _cells(f"ten_best.error.{joint}.{name}", words, unit, numbers, where)
        where = {**BEST, "quantity": "stiffness", "joint": "*", "coordinate": name}
        printed = PAPER["ten_best_stiffness"]
        numbers = {
            kind: float(printed[kind][STIFFNESS_KEY[name]]) for kind in ("median", "iqr", "range")
        }
        unit = STIFFNESS_UNITS[name]
        yield from _cells(f"ten_best.stiffness.{name}", f"{name} stiffness", unit, numbers, where)
    yield from _percent_of_median()
    yield from _in_discussion()


def _cells(
    key: str, words: str, unit: str, numbers: dict[str, float], where: dict[str, str]
) -> Iterator[Claim]:
    """Median, IQR and range of one quantity."""
    middle = within_width(numbers["median"], numbers["iqr"], "IQR")
    yield Claim(
        f"{key}.median",
        "Table 4",
        f"median {words}, ten best",
        unit,
        numbers["median"],
        middle,
        summary_median(**where),
        NO_RAW_DATA,
        _RANKED,
    )
    for kind in ("iqr", "range"):
        words_of = {"iqr": "IQR", "range": "range"}[kind]
        yield Claim(
            f"{key}.{kind}",
            "Table 4",
            f"{words_of} of {words}, ten best",
            unit,
            numbers[kind],
            factor_of_two(numbers[kind]),
            summary_cell(kind, **where),
            NO_RAW_DATA,
            _RANKED,
        )


def _percent_of_median() -> Iterator[Claim]:
    for kind in ("iqr", "range"):
        paper = float(PAPER["ten_best_anterior_stiffness_percent_of_median"][kind])
        yield Claim(
            f"ten_best.anterior_{kind}_percent",
            "section 3.3",
            f"{kind} of anterior stiffness of the ten best",
            "% of median",
            paper,
            factor_of_two(paper),
            summary_percent(kind, **BEST, quantity="stiffness", joint="*", coordinate="anterior"),
            NO_RAW_DATA,
            _RANKED,
        )


def _in_discussion() -> Iterator[Claim]:
    for name, kind in (("anterior", "median"), ("superior", "median"), ("extension", "iqr")):
        paper = float(PAPER["ten_best_error_in_discussion"][kind][MOTION_KEY[name]])
        cells = [
            PAPER["ten_best_error"][joint][kind][MOTION_KEY[name]] for joint in MEASURED_JOINTS
        ]
        yield Claim(
            f"discussion.ten_best.{name}.{kind}",
            "section 4",
            f"{kind} of {name} error of the ten best, larger of two joints",
            COORDINATE_UNITS[name],
            paper,
            exactly(paper),
            _larger(kind, name),
            NO_RAW_DATA,
            also=tuple(_cell_range(name, kind, joint) for joint in MEASURED_JOINTS),
            contradicted=f"A18: Table 4 has {cells[0]:g} and {cells[1]:g}, section 4 {paper:g}",
        )


def _cell_range(name: str, kind: str, joint: str) -> Range:
    """The range of a cell of Table 4, as its own row has it."""
    printed = PAPER["ten_best_error"][joint]
    median, iqr = (float(printed[key][MOTION_KEY[name]]) for key in ("median", "iqr"))
    return within_width(median, iqr, "IQR") if kind == "median" else factor_of_two(iqr)


def _larger(kind: str, name: str) -> Callable[..., Ours]:
    return summary_largest(kind, MEASURED_JOINTS, **BEST, quantity="error", coordinate=name)


def claims_of_best_model() -> Iterator[Claim]:
    """Stiffness and largest errors of the best model."""
    for name in FITTED:
        paper = float(_BEST["stiffness"][STIFFNESS_KEY[name]])
        spread = float(PAPER["ten_best_stiffness"]["range"][STIFFNESS_KEY[name]])
        yield Claim(
            f"best_model.stiffness.{name}",
            "section 3.3",
            f"{name} stiffness of the best model",
            STIFFNESS_UNITS[name],
            paper,
            within_width(paper, spread, "range over the ten best"),
            _stiffness(name),
            NO_RAW_DATA,
        )
    for name in FITTED:
        paper = float(_BEST["largest_error"][MOTION_KEY[name]])
        yield Claim(
            f"best_model.error.{name}",
            "section 3.3",
            f"{name} error of the best model, larger of two joints",
            COORDINATE_UNITS[name],
            paper,
            no_larger(paper),
            _error(name, MEASURED_JOINTS),
            NO_RAW_DATA,
        )
    yield from _percents()


def _percents() -> Iterator[Claim]:
    for name in FITTED:
        paper = float(_BEST["largest_error_percent"][name])
        yield Claim(
            f"best_model.error_percent.{name}",
            "section 3.3",
            f"{name} error of the best model, larger share of two joints",
            "% of measured",
            paper,
            factor_of_two(paper),
            _percent(name),
            NO_RAW_DATA,
            note="" if name == "anterior" else "of the motion in the best model's own joint frames",
            contradicted=_shear_motion(paper) if name == "anterior" else "",
            also=(factor_of_two(_shear_percent()),) if name == "anterior" else (),
        )
    share = float(PAPER["best_model"]["superior_error_of_L2L3"]["error_mm"])
    yield Claim(
        "best_model.error.superior.L2L3",
        "section 3.3",
        "superior error of the best model at L2L3",
        "mm",
        share,
        no_larger(share),
        _error("superior", ("L2L3",)),
        NO_RAW_DATA,
    )


def _shear_percent() -> float:
    """The printed anterior error in percent of the printed motion."""
    nominal = max(measured(joint, "anterior") for joint in MEASURED_JOINTS)
    return 100.0 * float(_BEST["largest_error"]["anterior_mm"]) / nominal


def _shear_motion(percent: float) -> str:
    error = float(_BEST["largest_error"]["anterior_mm"])
    nominal = max(measured(joint, "anterior") for joint in MEASURED_JOINTS)
    return (
        f"A17: {error:g} mm are {percent:g} % of {100.0 * error / percent:.2f} mm, "
        f"but the printed motion is {nominal:g} mm"
    )


def _stiffness(name: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        best = _pose(run)
        if best["joint"] != "*":
            raise NotComputed("stiffness is per joint in this study")
        return Ours(float(best[STIFFNESS_KEY[name]]), note=f"pose {int(best['pose'])}")

    return ours


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


def _motion(run: Run, joints: tuple[str, ...], column: str) -> "pd.Series[float]":
    """Largest size of a column over readings, per joint, in the best model."""
    pose = int(_pose(run)["pose"])
    rows = run.rows("simulations", pose=pose, stiffness=_CALIBRATED)
    rows = rows[rows["joint"].isin(joints)]
    sizes = rows.assign(size=rows[column].abs()).groupby("joint")["size"].max().dropna()
    if sizes.empty:
        raise NotComputed(f"the best model has no {column} at {' or '.join(joints)}")
    return sizes


def _pose(run: Run) -> "pd.Series[Any]":
    """Row of the reduced fit of least cost."""
    kept = run.rows("success", reduced=True)["pose"]
    fits = run.rows("calibrations")
    fits = fits[fits["pose"].isin(kept)].dropna(subset=["cost"])
    if fits.empty:
        raise NotComputed("no fit is left in the reduced dataset")
    return fits.iloc[int(fits["cost"].to_numpy().argmin())]
