"""The model in the joint poses of the paper, section 3.1."""

from collections.abc import Iterator

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim
from spinepipe.comparison.paper import (
    FITTED,
    MEASURED_JOINTS,
    MOTION_KEY,
    MOTION_UNIT,
    NO_RAW_DATA,
    PAPER,
    measured,
)
from spinepipe.comparison.ranges import factor_of_two

_SOURCE = {"part": "damping_bootstrap", "loading": "equilibrium", "dataset": "all"}
"""Fits in the cohort's own poses from the study's start; at rest damping does not enter."""

CONTRADICTED_PERCENT = {"extension": "A11"}


def claims() -> Iterator[Claim]:
    """Largest error of a joint, and the same in percent."""
    for name in FITTED:
        where = {**_SOURCE, "quantity": "error", "coordinate": name}
        paper = float(PAPER["nominal_model_error"][MOTION_KEY[name]])
        yield Claim(
            f"nominal_model.{name}.error", "section 3.1",
            f"{name} error in the cohort's own joint poses, larger of two joints",
            MOTION_UNIT[name], paper, factor_of_two(paper),
            summary.largest("median", MEASURED_JOINTS, **where), NO_RAW_DATA,
        )  # fmt: skip
        percent = float(PAPER["nominal_model_error_percent"][name])
        check = CONTRADICTED_PERCENT.get(name)
        yield Claim(
            f"nominal_model.{name}.error_percent", "section 3.1",
            f"{name} error in the cohort's own joint poses, larger of two joints",
            "% of measured", percent, factor_of_two(percent),
            summary.largest("percent_of_measured", MEASURED_JOINTS, **where), NO_RAW_DATA,
            contradicted="" if check is None else f"{check}: {_implied(paper, percent, name)}",
        )  # fmt: skip


def _implied(error: float, percent: float, name: str) -> str:
    parts = [f"{100.0 * error / measured(joint, name):.1f}" for joint in MEASURED_JOINTS]
    return (
        f"{error:g} {MOTION_UNIT[name]} are {' or '.join(parts)} % of the printed motion, "
        f"not {percent:g} %"
    )
