"""Gould et al. 2024b as the comparison reads it: its numbers, its loads and models.

Forms of claims that many of the paper's numbers share.

Rows of a run by the paper's names of models and stages.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.anatomy import published
from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run, Verdict, exactly
from spinepipe.studies.cohort_stiffness.representations import start_of
from spinepipe.studies.cohort_stiffness.stages import largest_mean_motion

PAPER = published("gould_2024b")
COUNTS = PAPER["counts"]
SPECIMENS = int(COUNTS["specimens"])
P_BELOW = float(PAPER["significance"]["p_below"])
MOMENT_NM = float(PAPER["load"]["largest_moment_nm"])

TESTS = ("left_lateral_bending", "left_axial_rotation", "flexion")
"""Load cases in the order of the paper."""

LOAD = dict(zip(TESTS, ("lateral bending", "axial rotation", "flexion"), strict=True))
LOADED = {test: str(PAPER["loaded_coordinate"][test]) for test in TESTS}
"""The coordinate that a load case drives, and whose error is reported."""

COORDINATES = ("right_bending", "left_rotation", "extension")
"""Rotations in the order of the paper's tables."""

JOINTS = tuple(name for name in PAPER["level_stiffness"] if name != "where")
LOWER_FIVE = JOINTS[1:]
"""The five levels that the paper's numbers point to (B5)."""

LITERATURE = {name: start_of(name) for name in ("per_specimen", "level_ratio")}
"""The paper's two models, and what each is before it is fitted."""

MODELS = tuple(LITERATURE)
STAGES = ("literature", "fitted", "left_out_specimen")

PHANTOM = (
    "the paper's motion is not published; ours is that of a phantom with linear stiffness, whose "
    "geometry, levels, coupled moments and noise are assumed (docs/decisions/0006)"
)
PUT_IN = (
    "the phantom's specimen factors were drawn with the median and spread that Table 3 has in the "
    "loaded coordinate"
)
NOT_BY_SPECIMEN = (
    "compared as a distribution: the phantom's specimens are not those of the paper, so that no "
    "specimen stands beside its namesake"
)


def not_converged(model: str, test: str) -> tuple[str, ...]:
    """Specimens of the paper whose fit did not end."""
    return tuple(PAPER["not_converged"].get(model, {}).get(test, ()))


def uniform(name: str) -> float:
    """Published stiffness of all joints, N m/rad."""
    return float(PAPER["uniform_stiffness"][f"{name}_nm_per_rad"])


def of_level(joint: str, name: str) -> float:
    """Published stiffness of one joint, N m/rad."""
    return float(PAPER["level_stiffness"][joint][f"{name}_nm_per_rad"])


def table_3(test: str, name: str) -> dict[str, float]:
    """Fitted stiffness of the specimens whose fit ended, N m/rad."""
    printed = PAPER["fitted_stiffness_nm_per_rad"][test][name]
    return {specimen: float(value) for specimen, value in printed.items()}


def spread(test: str, name: str) -> float:
    """Largest less smallest value of one row of Table 3, N m/rad."""
    values = table_3(test, name).values()
    return max(values) - min(values)


def table_4(model: str, test: str, stage: str, what: str) -> float:
    """One cell of Table 4."""
    return float(PAPER["mae"][model][test][stage][what])


YES_NO = "1: yes, 0: no"


def yes_or_no(
    key: str,
    where: str,
    quantity: str,
    paper: bool,
    ours: Callable[[Run], Ours],
    outside: str = PHANTOM,
    note: str = "",
    evidence: Verdict = Verdict.INSIDE,
) -> Claim:
    """Something that the paper says to be so or not."""
    value = float(paper)
    return Claim(
        key, where, quantity, YES_NO, value, exactly(value), ours, outside, note, evidence=evidence
    )


def recomputed(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    allowed: Range,
    ours: float,
    note: str,
) -> Claim:
    """A number that the paper's other numbers give."""
    return Claim(
        f"closed_form.{key}",
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        "the formula does not give the printed number",
        note,
        evidence=Verdict.RECOMPUTED,
    )


def contradicted(
    key: str,
    where: str,
    quantity: str,
    unit: str,
    paper: float | None,
    ours: float,
    reason: str,
) -> Claim:
    """A number that the paper's other numbers exclude."""
    allowed = Range(paper, paper, "the paper's value itself")
    return Claim(
        key,
        where,
        quantity,
        unit,
        paper,
        allowed,
        lambda run: Ours(ours),
        "",
        note="ours: from the paper's other numbers",
        contradicted=reason,
    )


def rounded(value: float, unit_of_last_digit: float) -> Range:
    """What rounds to a printed number."""
    half = unit_of_last_digit / 2.0
    return Range(value - half, value + half, "what rounds to the printed number")


def of_stage(model: str, stage: str, test: str) -> dict[str, str]:
    """Keys of the stiffness that a model has at a stage; fitted to one load case, as published."""
    if stage == "literature":
        return {"representation": LITERATURE[model], "fitted_to": "nothing", "source": "literature"}
    source = {"fitted": "own", "left_out_specimen": "others_median"}[stage]
    return {"representation": model, "fitted_to": test, "source": source}


def stiffness(run: Run, model: str, test: str, coordinate: str) -> pd.DataFrame:
    """Fitted stiffness, one row per specimen and joint; at least one."""
    where = of_stage(model, "fitted", test)
    rows = run.rows("stiffness", **where, coordinate=coordinate).dropna(subset=["stiffness"])
    if rows.empty:
        raise NotComputed("no fit ended with a stiffness")
    return rows


def errors(run: Run, model: str, stage: str, test: str, coordinate: str = "") -> pd.DataFrame:
    """Errors at the largest load, one row per specimen and joint, in the loaded coordinate.

    Parameters
    ----------
    coordinate : another coordinate instead of the loaded one.
    """
    where = of_stage(model, stage, test)
    seen = run.rows("errors", **where, test=test, coordinate=coordinate or LOADED[test])
    seen = seen.dropna(subset=["peak_error", "measured_peak"])
    if seen.empty:
        raise NotComputed("no motion was predicted")
    return seen


def over_prediction(seen: pd.DataFrame) -> "pd.Series[Any]":
    """How much larger the predicted motion is than the measured one, deg."""
    return predicted(seen) - seen["measured_peak"].abs()


def predicted(seen: pd.DataFrame) -> "pd.Series[Any]":
    """Size of the predicted motion at the largest load, deg."""
    return (seen["peak_error"] + seen["measured_peak"]).abs()


def rms(seen: pd.DataFrame, by: str) -> "pd.Series[Any]":
    """Root mean square error at the largest load within each group, deg."""
    return seen["peak_error"].pow(2).groupby(seen[by]).mean().pow(0.5)


def whole_rms(seen: pd.DataFrame) -> float:
    """Root mean square error at the largest load over all rows, deg."""
    return float(np.sqrt(np.mean(seen["peak_error"].to_numpy(dtype=float) ** 2)))


def largest_motion(seen: pd.DataFrame) -> float:
    """Largest over specimens of the mean measured motion over joints, deg."""
    largest = largest_mean_motion(seen)
    assert largest is not None  # `errors` has no empty ones
    return largest
