"""Job: how lumbar joints share a motion, mean over parts of its cycle."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.tracking.reload_motions import kinds_of_trials, motions
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.shares import LUMBAR_JOINTS, shares_of
from spinepipe.studies.tracking.tables import DONE, SHARING, TOO_FEW, TOO_SMALL, WINDOWS
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``sharing.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(sharing_rows(read_frames(tables)["tracked"], kinds_of_trials(cohort)))
    write(from_rows(SHARING, rows), output, provenance("sharing", settings, cohort))


def sharing_rows(
    tracked: pd.DataFrame, kinds: Mapping[tuple[str, str], str]
) -> Iterator[dict[str, Any]]:
    """Rows by motion, window and joint; none of a stance."""
    for moved in motions(tracked):
        shares = shares_of(moved, kinds[moved.specimen, moved.trial])
        if shares is None:
            continue
        for window, ends in WINDOWS.items():
            inside = shares.inside(ends)
            used = inside & shares.enough
            few = TOO_SMALL if inside.any() else TOO_FEW
            for k, joint in enumerate(LUMBAR_JOINTS):
                yield {
                    "specimen": moved.specimen,
                    "trial": moved.trial,
                    "approach": moved.approach,
                    "joint": joint,
                    "window": window,
                    "share": float(shares.share[used, k].mean()) if used.any() else None,
                    "frames_used": int(used.sum()),
                    "status": DONE if used.any() else few,
                }
