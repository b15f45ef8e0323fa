"""Passive elements beside the generic ones: how much they were changed, and which way."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.comparison.claim import Claim, NotComputed, Ours, Range, Run
from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.passive_elements import PassiveElements, passive_elements
from spinepipe.motion.skeleton import JOINTS
from spinepipe.studies.tracking.forms import PASSIVE
from spinepipe.studies.tracking.laws import LOW_MOMENT_NM
from spinepipe.studies.tracking.persons import own_rows
from spinepipe.studies.tracking.wang_2021.found import farthest, first_of
from spinepipe.studies.tracking.wang_2021.paper import OTHER_PERSONS, missing, yes_no
from spinepipe.units import COORDINATES

MAIN = ("extension", "right_bending")
"""Directions that the motions are in."""

LAWS = ("optk_from_both", "optk_from_bending", "optk_from_flexion")
"""Calibrations; the first that the study has stands for the paper's."""

MULTIPLIERS = Range(0.4, 4.57, "the paper's range over persons and joints")
HARDLY = 0.02
"""Share by which stiffness differs that markers left where it was."""

_SIDE = ["joint", "coordinate", "side"]
_PRIOR = "a prior draws ours to the generic ones where markers tell little, see scales"
_NOT_THIS = "a number of other papers, of which nothing here is made"


def claims_of_stiffness() -> Iterator[Claim]:
    """Multipliers, then stiffness at a low and at a high moment."""
    yield Claim(
        "results.pe_parameter_multiplier",
        "Results",
        "parameter A or B over the generic one, main directions, the one farthest from 0.4 to 4.57 "
        "or nearest to its ends",
        "ratio",
        None,
        MULTIPLIERS,
        _multipliers,
        OTHER_PERSONS,
        _PRIOR,
    )
    yield yes_no(
        "results.stiffness_low_resistance_zone",
        "Results",
        "at a low moment most calibrated joints are less stiff than generic ones",
        _mostly_softer,
        _PRIOR,
    )
    yield yes_no(
        "results.stiffness_high_resistance_zone",
        "Results",
        "at a high moment most calibrated joints are stiffer than generic ones",
        _mostly_stiffer,
        _PRIOR,
    )
    for key, where, quantity, unit, paper in (
        ("reference_age_in_vivo", "Discussion", "age of persons of other papers", "years", None),
        ("generic_stiffness_reference_age", "Evaluation", "age of tested spines", "years", 50.0),
        ("bayesian_marker_error", "Discussion", "mean error of joint angles", "deg", 1.45),
    ):
        yield missing(f"results.{key}", where, quantity, unit, paper, _NOT_THIS)


def generic_rows(cohort: Cohort) -> pd.DataFrame:
    """Passive elements that calibrations of a cohort begin with, by joint, coordinate and side."""
    file = f"{cohort.name}/{PASSIVE.file}"
    found = passive_elements(own_rows(cohort, PASSIVE.stem), file)
    return rows_of(found)


def rows_of(elements: PassiveElements) -> pd.DataFrame:
    """The same of elements."""
    shape = elements.a.shape
    return pd.DataFrame(
        [
            (
                *(JOINTS[place[0]], COORDINATES[place[1]], SIDES[place[2]]),
                *(float(values[place]) for values in (elements.a, elements.b, elements.lower)),
            )
            for place in np.ndindex(*shape)
        ],
        columns=[*_SIDE, "a", "b", "lower"],
    )


def _beside_generic(run: Run) -> pd.DataFrame:
    """Sides that were loaded, with columns of the generic ones ending in `_generic`."""
    law = first_of(run, "stiffness", LAWS, "law")
    rows = run.rows("stiffness", law=law)
    rows = rows[rows["coordinate"].isin(MAIN)].dropna(subset=["a", "high_moment_nm"])
    both = rows.merge(run.rows("generic"), on=_SIDE, suffixes=("", "_generic"))
    if both.empty:
        raise NotComputed(f"no joint was loaded in the motions of {law}")
    return both


def _multipliers(run: Run) -> Ours:
    rows = _beside_generic(run)
    found = np.concatenate([rows[name] / rows[f"{name}_generic"] for name in ("a", "b")])
    assert MULTIPLIERS.low is not None
    assert MULTIPLIERS.high is not None
    logs = Range(float(np.log(MULTIPLIERS.low)), float(np.log(MULTIPLIERS.high)), "")
    note = f"median {np.median(found):.3g}; sides that were loaded, {rows['law'].iloc[0]}"
    value = float(np.exp(farthest(np.log(found), logs)))
    return Ours(value, float(found.min()), float(found.max()), note)


def _mostly_softer(run: Run) -> tuple[bool, str]:
    rows = _beside_generic(run)
    a, b = rows["a_generic"], rows["b_generic"]
    own = rows["at_low_moment"].to_numpy(float)
    usual, lowest = (
        (b * (LOW_MOMENT_NM + a * factor)).to_numpy(float) for factor in (1.0, rows["lower"])
    )
    beyond = f"{np.mean(own < lowest):.0%} below the lower end of generic ones"
    return _share(own / usual < 1.0, own / usual, beyond)


def _mostly_stiffer(run: Run) -> tuple[bool, str]:
    ratio = _beside_generic(run)["ratio_to_generic"].to_numpy(float)
    return _share(ratio > 1.0, ratio)


def _share(holds: NDArray[np.bool_], ratio: Array, further: str = "") -> tuple[bool, str]:
    """Whether most do, and numbers that decide it."""
    share = float(np.mean(holds))
    notes = (
        f"ours: {share:.0%} of {len(ratio)} sides that were loaded",
        further,
        f"ratio {np.median(ratio):.3g} (median), {ratio.min():.3g} to {ratio.max():.3g}",
        f"{np.mean(np.abs(ratio - 1.0) < HARDLY):.0%} differ by less than {HARDLY:.0%}",
    )
    return share > 0.5, "; ".join(note for note in notes if note)
