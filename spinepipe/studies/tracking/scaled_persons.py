"""How large a person is beside the cohort's skeleton, by the markers of the static trial."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.motion.scaling import SEGMENTS, ScalingFit, fitted
from spinepipe.motion.skeleton import MarkerSet, MarkerTrial, Skeleton
from spinepipe.studies.tracking.tables import NO_STATIC, NOT_TOLD, TOLD

AS_IT_IS = "the cohort's skeleton is taken as it is"


@dataclass(frozen=True, eq=False)
class ScaledPerson:
    """What markers say of the size.

    Attributes
    ----------
    fit : factors and what they leave; None where markers do not tell the size, status and message
        say why.
    """

    fit: ScalingFit | None
    status: str
    message: str = ""


def sized_by(skeleton: Skeleton, markers: MarkerSet, static: MarkerTrial | None) -> ScaledPerson:
    """How large a person is.

    Parameters
    ----------
    skeleton, markers : the cohort's. static : the person stands still; None where there is none.
    """
    if static is None:
        return ScaledPerson(None, NO_STATIC, f"no trial tells the size; {AS_IT_IS}")
    try:
        return ScaledPerson(fitted(skeleton, markers, static), TOLD)
    except ValueError as why:
        return ScaledPerson(None, NOT_TOLD, f"{why}; {AS_IT_IS}")


def size_rows(specimen: str, found: ScaledPerson) -> Iterator[dict[str, Any]]:
    """Rows of table `sizes`, by part of the skeleton."""
    fit = found.fit
    worst = ("", "") if fit is None else fit.largest_pair
    for k, segment in enumerate(SEGMENTS):
        yield {
            "specimen": specimen,
            "segment": segment,
            "factor": None if fit is None else float(fit.factors[k]),
            "n_pairs": 0 if fit is None else fit.n_pairs,
            "rms_mm": None if fit is None else fit.rms_mm,
            "largest_mm": None if fit is None else fit.largest_mm,
            "first_marker": worst[0],
            "second_marker": worst[1],
            "status": found.status,
            "message": found.message,
        }


def factors_in(sizes: pd.DataFrame, specimen: str) -> Array | None:
    """(3,) factors of a person, of table `sizes`; None where markers do not tell them."""
    rows = sizes[sizes["specimen"] == specimen].set_index("segment")["factor"]
    return None if rows.isna().any() else rows[list(SEGMENTS)].to_numpy(float)
