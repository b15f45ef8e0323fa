"""What laboratories report of an experiment, as sentences: measured, and by the fitted model."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.experiment.double_sigmoid import Zone
from spinepipe.report.words import count, number
from spinepipe.studies.cohort_stiffness.loop_rows import paired_curves
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import (
    DIRECTION,
    MEASURED,
    NOT_READ,
    SIMULATED,
    SMALL,
    WHOLE,
)

_SOFT = [Zone.FOUND.value, Zone.NOT_DESCRIBED.value]

_WHY = {
    Zone.ONE_SIDE.value: "loaded to one side only",
    Zone.TOO_FEW.value: "too few loads from side to side",
    Zone.NOT_READ.value: "not read",
}


def ranges(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How far joints move, and how far the fitted model does.

    A curve agrees where the difference is within its 95 % limit. The model was fitted to these
    readings, so what it is unsure of is part of their noise: residuals of a least squares fit have
    the variance of the readings less that of the model, not the sum (Cook and Weisberg, Residuals
    and influence in regression, 1982, section 2.1).
    """
    found = paired_curves(rows, "range_of_motion", "deg").dropna(subset=["measured", "simulated"])
    if found.empty:
        return
    differences = found["simulated"] - found["measured"]
    low, middle, high = (float(differences.quantile(share)) for share in (0.25, 0.5, 0.75))
    name = max(rows["representation"])  # of readings there is none
    told = (
        f"Range of motion, the model ({IN_WORDS[name]}) less the joint: median {number(middle, 2)}°"
        f" over {count(len(found), 'curve')}, middle half {number(low, 2)}° to {number(high, 2)}°"
    )
    square = found["measured_way"] ** 2 - found["simulated_way"] ** 2
    known = square > 0.0  # where the model is as unsure as the readings, there is no limit
    if known.any():
        agree = int((differences[known] ** 2 <= square[known]).sum())
        told += (
            f"; {agree} of {int(known.sum())} are within the 95 % limits of what noise of readings "
            "leaves of a fit to them, and 95 in 100 would be where only that is left"
        )
    yield f"{told}. The stiffness was fitted to these readings, so this is no prediction."


def zones(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How many curves are softer in the middle, by how much, and whether the model's are.

    Softer: a sigmoid fits better than a straight line, by more than noise (5 %).
    """
    measured, model = (rows[rows["source"] == source] for source in (MEASURED, SIMULATED))
    asked = measured[measured["neutral_zone"].isin([*_SOFT, Zone.NOT_MEANINGFUL])]
    if asked.empty:
        reasons = measured["neutral_zone"].value_counts()
        why = ", ".join(f"{_WHY[str(word)]} {many}" for word, many in reasons.items())
        yield f"No curve can tell a neutral zone ({why})."
        return
    soft, found = (asked["neutral_zone"].isin(words) for words in (_SOFT, [Zone.FOUND]))
    there = int(model["neutral_zone"].isin(_SOFT).sum())
    told = (
        f"{int(soft.sum())} of {count(len(asked), 'curve')} from side to side are softer in the "
        f"middle; of the model {there} are"
    )
    if found.any():
        middle = number(float(asked.loc[found, "neutral_zone_deg"].median()), 2)
        told += f". Neutral zone: median {middle}° over {count(int(found.sum()), 'curve')}"
    lost = int((soft & ~found).sum())
    if lost:
        told += f"; {lost} bend in another way than sigmoids do and have no number"
    yield f"{told}."


def hysteresis(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How much work a cycle loses, measured and in the model."""
    found = paired_curves(rows, "hysteresis_area", "j").dropna(subset=["measured"])
    if found.empty:
        yield "No closed loop was read: whether joints lose work in a cycle is not known."
        return
    sure = found["measured_way"].notna()
    lost = int((found["measured"] - found["measured_way"] > 0.0).sum())
    share = f"; {lost} of {int(sure.sum())} lose work for sure (95 %)" if sure.any() else ""
    model, beside = found["simulated"].dropna(), ""
    if len(model):  # what solving leaves of a loop without area is none
        work = float(model.median())
        beside = f", in the model {number(work if abs(work) >= 1e-9 else 0.0, 2)} J"
    yield (
        f"Work lost in a closed cycle: median {number(found['measured'].median(), 2)} J over "
        f"{count(len(found), 'loop')}{share}{beside}."
    )


def axes(study: CohortStiffness, rows: pd.DataFrame) -> Iterator[str]:
    """How many motions have an axis, and how sure its place is."""
    measured = rows[rows["source"] == MEASURED]
    many = measured["status"].value_counts()
    placed = measured[measured["status"] == WHOLE]
    parts = [
        f"{many[word]} {told}"
        for word, told in (
            (SMALL, "turn by less than 2°"),
            (DIRECTION, "have a direction and no place, for translations were not read"),
            (NOT_READ, "lack a rotation"),
        )
        if word in many.index
    ]
    told = f"Helical axes: {len(placed)} of {count(len(measured), 'motion')} have a centre"
    sds = placed[["centre_anterior_sd_mm", "centre_superior_sd_mm"]].astype(float).dropna()
    if len(sds):
        both_sds = np.hypot(*sds.to_numpy().T)
        told += f", in the sagittal plane sure to {number(float(np.median(both_sds)), 2)} mm (SD)"
    yield f"{told}{'; ' if parts else ''}{'; '.join(parts)}."
