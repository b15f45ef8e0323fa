"""Job: which representation is best, by errors and by information criteria."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statistics import wilcoxon_signed_rank
from spinepipe.status import joined
from spinepipe.studies.cohort_stiffness.representations import NAMES, POOLED, PUBLISHED
from spinepipe.studies.cohort_stiffness.settings import NOBODY, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import (
    LEFT_OUT_SPECIMEN,
    LITERATURE,
    joint_label_of,
    of_joint_fits,
    specimen_rms,
    unit_of,
    without_result,
)
from spinepipe.studies.cohort_stiffness.tables import CRITERIA, RANKING
from spinepipe.tables import from_rows, read_frames, write

INFORMATION = ("aicc", "bic")
_SPREADS = ("between_levels", "between_specimens", "between_joints")
SPREADS = (*_SPREADS, *(f"growth_{name}" for name in _SPREADS))
NO_P = "no p for information criteria: pooled specimens are not independent"
NO_RESULT = "no specimen has a result"
NONE_COMPLETE = "no specimen has a result in every representation"
Row = dict[str, Any]

Candidate = tuple[str, str]
"""Representation and source."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``ranking.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    frames = read_frames(tables)
    rows = ranking_rows(frames["errors"], frames["fits"], frames.get("pooling"))
    origin = provenance("ranking", settings, cohort)
    write(from_rows(RANKING, rows), output, origin)


def ranking_rows(
    errors: pd.DataFrame, fits: pd.DataFrame, pooling: pd.DataFrame | None = None
) -> list[Row]:
    """Rows of the table ``ranking`` from those of ``errors``, ``fits`` and ``pooling``."""
    present = {*errors["representation"], *fits["representation"]}
    names = [name for name in NAMES if name in present]
    specimens = {*errors["specimen"], *fits["specimen"]}
    rows = []
    for criterion in CRITERIA:
        if criterion in INFORMATION:
            found = _information(fits, criterion, [n for n in names if n not in PUBLISHED])
            counts = dict.fromkeys(POOLED, 0)
            if pooling is not None:  # the spreads that a fit to all load cases has estimated
                here = (pooling["fitted_to"] == joint_label_of(fits)) & (
                    pooling["without"] == NOBODY
                )
                for name in POOLED:
                    of_name = pooling.loc[here & (pooling["representation"] == name), list(SPREADS)]
                    counts[name] = int(of_name.notna().sum().sum())
            order = rank_candidates(found, True, specimens, _penalty(fits, criterion, counts))
            for row in order:
                if row["representation"] in POOLED and row["value"] is not None:
                    # Vaida and Blanchard 2005: random effects count by their effective number
                    count = counts[row["representation"]]
                    note = f"conditional criterion; {count} spreads of the cohort counted once "
                    row["message"] = joined(f"{note}as unknowns", row["message"])
        else:
            found = _errors(errors, criterion, names)
            order = rank_candidates(found, False, specimens, unit=unit_of(errors))
        rows += [{"criterion": criterion, **row} for row in order]
    return rows


def _penalty(
    fits: pd.DataFrame, criterion: str, counts: Mapping[str, int]
) -> dict[Candidate, float]:
    """What the spreads add to the cohort's criterion, which fits of specimens do not count."""
    found = {}
    for name, count in counts.items():
        here = (fits["fitted_to"] == joint_label_of(fits)) & (fits["representation"] == name)
        readings = int(fits.loc[here, "readings"].sum())
        if count and readings:
            each = 2.0 if criterion == "aicc" else float(np.log(readings))
            found[name, "own"] = count * each
    return found


def _errors(errors: pd.DataFrame, criterion: str, names: list[str]) -> dict[Candidate, pd.Series]:
    """Error by specimen of each representation; the literature's is the same everywhere."""
    found = {}
    for name in names:
        stage = LITERATURE if name in PUBLISHED else criterion
        chosen = of_joint_fits(errors, stage)
        chosen = chosen[chosen["representation"] == name]
        source = "own"
        if name in PUBLISHED:
            source = "literature"
        elif criterion == LEFT_OUT_SPECIMEN:
            source = "others_pooled" if name in POOLED else "others_median"
        found[name, source] = specimen_rms(chosen, errors)
    return found


def _information(
    fits: pd.DataFrame, criterion: str, names: list[str]
) -> dict[Candidate, pd.Series]:
    """Criterion by specimen of each representation fitted to all load cases."""
    joint = fits[fits["fitted_to"] == joint_label_of(fits)].dropna(subset=criterion)
    found = {}
    for name in names:
        of_name = joint[joint["representation"] == name]
        found[name, "own"] = of_name.set_index("specimen")[criterion].astype(float)
    return found


def rank_candidates(
    found: dict[Candidate, pd.Series],
    summed: bool,
    specimens: Iterable[str] = (),
    once: Mapping[Candidate, float] = MappingProxyType({}),
    unit: str = "deg",
) -> list[Row]:
    """Candidates in order, over the specimens that have a value of all of them.

    Parameters
    ----------
    found : value by specimen of each candidate; one without any value takes no part.
    summed : whether the criterion is the sum over specimens, else their mean.
    specimens : all there are; those without any value are told of too.
    once : what counts once in a sum, not once per specimen; shared out evenly over them.
    unit : of the values; sums have none.
    """
    unit = "" if summed else unit
    compared = [candidate for candidate, values in found.items() if len(values)]
    table = pd.DataFrame({candidate: found[candidate] for candidate in compared})
    complete = table.dropna()
    none = [_row(one, unit, NO_RESULT) for one in found if one not in compared]
    if complete.empty:
        return [_row(one, unit, NONE_COMPLETE) for one in compared] + none
    by_name = {candidate[0]: found[candidate] for candidate in compared}
    lost = without_result(by_name, {*table.index, *specimens})
    told = f"left out, without a result: {lost}" if lost else ""
    # What counts once is shared out evenly, so that sums have it and paired differences too.
    share = {one: once.get(one, 0.0) / len(complete) for one in compared}
    values = {one: complete[one].to_numpy(float) + share[one] for one in compared}
    best = min(compared, key=lambda one: values[one].mean())
    rows = []
    for one in sorted(compared, key=lambda one: values[one].mean()):
        ahead = sum(bool(other.mean() < values[one].mean()) for other in values.values())
        row = _row(one, unit, told)
        row |= {"rank": 1 + ahead, "specimens": len(complete)}
        row |= dict(zip(("value", "standard_error"), _total(values[one], summed), strict=True))
        rows.append(row if one == best else row | _against(values[one], values[best], summed, row))
    rows[0]["worse_than_best"] = 0.0
    return rows + none


def _row(candidate: Candidate, unit: str, message: str) -> Row:
    """One row, without its numbers yet."""
    empty = ("rank", "value", "standard_error", "worse_than_best", "worse_standard_error", "p")
    return {
        "representation": candidate[0],
        "source": candidate[1],
        "unit": unit,
        "specimens": 0,
        "message": message,
        **dict.fromkeys(empty),
    }


def _against(values: Array, best: Array, summed: bool, row: Row) -> Row:
    """How much worse than the best, paired specimen by specimen; values, best: (specimens,)."""
    worse, error = _total(values - best, summed)
    # A mean of equal values may round to -1e-17.
    told = {"worse_than_best": max(worse, 0.0), "worse_standard_error": error}
    if summed:
        return {**told, "message": joined(row["message"], NO_P)}
    tested = wilcoxon_signed_rank(values, best)
    without = "" if tested.p is not None else f"no p: {tested.message}"
    return {**told, "p": tested.p, "message": joined(row["message"], without)}


def _total(values: Array, summed: bool) -> tuple[float, float | None]:
    """Mean or sum of values (specimens,) and its standard error."""
    n = len(values)
    scale = float(n) if summed else 1.0
    error = float(scale * values.std(ddof=1) / np.sqrt(n)) if n > 1 else None
    return float(scale * values.mean()), error
