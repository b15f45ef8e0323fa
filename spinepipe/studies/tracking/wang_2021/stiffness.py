"""Passive elements beside the generic ones: how much they were changed, and which way."""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run
from spinepipe.effects.contract import Array
from spinepipe.studies.tracking.wang_2021.found import LEARNT, first_of, numbers
from spinepipe.studies.tracking.wang_2021.paper import OTHER_PERSONS, missing, yes_no

MAIN = ("extension", "right_bending")
"""Directions that the motions are in."""

GENERIC = "optk_generic"
_SIDE = ["specimen", "joint", "coordinate", "side"]
_NOT_THIS = "a number of other papers, of which nothing here is made"


def claims_of_stiffness() -> Iterator[Claim]:
    """Multipliers, then stiffness at a low and at a high moment."""
    yield Claim(
        "results.pe_parameter_multiplier",
        "Results",
        "parameters A and B over the generic ones, main directions, median",
        "ratio",
        None,
        Range(0.4, 4.57, "the paper's range over persons and joints"),
        _multipliers,
        OTHER_PERSONS,
    )
    yield yes_no(
        "results.stiffness_low_resistance_zone",
        "Results",
        "at a low moment most calibrated joints are less stiff than generic ones",
        _mostly(_low, below=True),
    )
    yield yes_no(
        "results.stiffness_high_resistance_zone",
        "Results",
        "at a high moment most calibrated joints are stiffer than generic ones",
        _mostly(_high, below=False),
    )
    for key, where, quantity, unit, paper in (
        ("reference_age_in_vivo", "Discussion", "age of persons of other papers", "years", None),
        ("generic_stiffness_reference_age", "Evaluation", "age of tested spines", "years", 50.0),
        ("bayesian_marker_error", "Discussion", "mean error of joint angles", "deg", 1.45),
    ):
        yield missing(f"results.{key}", where, quantity, unit, paper, _NOT_THIS)


def _calibrated(run: Run) -> pd.DataFrame:
    approach = first_of(run, "stiffness", LEARNT[::-1])
    rows = run.rows("stiffness", approach=approach)
    return rows[rows["coordinate"].isin(MAIN)]


def _beside_generic(run: Run) -> pd.DataFrame:
    """Calibrated rows, with columns of the generic ones ending in `_generic`."""
    generic = run.rows("stiffness", approach=GENERIC)
    both = _calibrated(run).merge(generic, on=_SIDE, suffixes=("", "_generic"))
    if both.empty:
        raise NotComputed("this run has no generic stiffness beside the calibrated one")
    return both


def _multipliers(run: Run) -> Ours:
    rows = _beside_generic(run)
    found = np.concatenate([rows[name] / rows[f"{name}_generic"] for name in ("a", "b")])
    return Ours(float(np.median(found)), float(found.min()), float(found.max()))


def _low(run: Run) -> Array:
    rows = _beside_generic(run).dropna(subset=["at_low_moment", "at_low_moment_generic"])
    if rows.empty:
        raise NotComputed("this run has no stiffness at a low moment")
    found: Array = (rows["at_low_moment"] / rows["at_low_moment_generic"]).to_numpy(float)
    return found


def _high(run: Run) -> Array:
    return numbers(_calibrated(run), "ratio_to_generic")


def _mostly(ratios: Callable[[Run], Array], below: bool) -> Callable[[Run], tuple[bool, str]]:
    def found(run: Run) -> tuple[bool, str]:
        values = ratios(run)
        share = float(np.mean(values < 1.0 if below else values > 1.0))
        return share > 0.5, f"ours: {share:.0%} of {len(values)}"

    return found
