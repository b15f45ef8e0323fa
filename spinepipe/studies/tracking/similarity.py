"""Job: how alike persons share a motion among their lumbar joints.

A person's curve is the shares of the lumbar joints over a part of the cycle, one joint's after the
other's: what differs from joint to joint counts as much as what changes over time. The paper that
this is from (Wang et al. 2021) does not say how it put joints together.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statistics.waveforms import MultipleCorrelation, multiple_correlation
from spinepipe.studies.tracking.reload_motions import kinds_of_trials, motions
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.shares import INSTANTS, MotionShares, shares_of
from spinepipe.studies.tracking.tables import SIMILARITY, WINDOWS
from spinepipe.tables import from_rows, read_frames, write

ENOUGH = 0.5
"""Share of the instants of a window at which a person has to be turned enough to count."""


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``similarity.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(similarity_rows(read_frames(tables)["tracked"], kinds_of_trials(cohort)))
    write(from_rows(SIMILARITY, rows), output, provenance("similarity", settings, cohort))


def similarity_rows(
    tracked: pd.DataFrame, kinds: Mapping[tuple[str, str], str]
) -> Iterator[dict[str, Any]]:
    """Rows by trial, approach and window, over the persons that did it."""
    groups: dict[tuple[str, str], list[MotionShares]] = {}
    for moved in motions(tracked):
        shares = shares_of(moved, kinds[moved.specimen, moved.trial], INSTANTS)
        if shares is not None:
            groups.setdefault((moved.trial, moved.approach), []).append(shares)
    for (trial, approach), persons in groups.items():
        for window, ends in WINDOWS.items():
            found, left_out = alike(persons, ends)
            yield {
                "trial": trial,
                "approach": approach,
                "window": window,
                "cmc": found.value,
                "n_specimens": found.curves,
                "status": found.status.value,
                "message": "; ".join(part for part in (found.message, left_out) if part),
            }


def alike(
    persons: Sequence[MotionShares], window: tuple[float, float]
) -> tuple[MultipleCorrelation, str]:
    """Coefficient over persons, and what was left out of it.

    Persons that are turned enough at less than half the instants are left out, then the instants at
    which one of the others is not.
    """
    inside = persons[0].inside(window)
    kept = [one for one in persons if one.enough[inside].mean() >= ENOUGH]
    used = np.logical_and.reduce([inside, *(one.enough for one in kept)])
    curves = np.array([one.share[used].T.ravel() for one in kept])
    told = []
    if len(kept) < len(persons):
        told.append(f"{len(persons) - len(kept)} persons turned too little")
    if kept and used.sum() < inside.sum():
        told.append(f"{inside.sum() - used.sum()} of {inside.sum()} instants left out")
    return multiple_correlation(curves.reshape(len(kept), -1)), "; ".join(told)
