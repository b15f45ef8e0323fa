"""Job: errors of segments' rotations by how near the films bring them to the published ends.

The classes are those of Jalalian 2017 Fig. 7. On the films that the ends are taken from, a segment
that turns with the bend lies at 1 / 1.2 of its end, so that fitted films fill one class with all of
these. A held-out film may have a segment beyond its end, where the published law has no load.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.errors import of_group, of_rotations, with_reduction
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import BEYOND, BY_RANGE, EVERY, GROUPS, RANGES
from spinepipe.tables import from_rows, read_frames, write

DECIMALS = 9
"""Films are read in steps, so shares fall on the ends of classes; rounding must not move them."""

CLASSES = (*RANGES, BEYOND)


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``by_range.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    rows = list(by_range_rows(read_frames(tables)["displacements"]))
    write(from_rows(BY_RANGE, rows), output, provenance("by_range", settings, cohort))


def by_range_rows(displacements: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows by group of films, whether segments turn against a bend, class and model."""
    read = displacements.dropna(subset=["measured_deg"])
    errors = read.assign(
        square=of_rotations(read) ** 2,
        range=classes(read["share_of_range"].to_numpy(float)),
    )
    models = list(displacements["model"].unique())
    for group in GROUPS:
        known = of_group(errors, group)
        posed = known["square"].notna().groupby([known["specimen"], known["model"]])
        known = known[posed.transform("all")]  # patients that lack a pose on a film are left out
        for opposite, name in product((False, True), (*CLASSES, EVERY)):
            chosen = known[known["opposite"].astype(bool) == opposite]
            if name != EVERY:
                chosen = chosen[chosen["range"] == name]
            place = {"films": group, "opposite": opposite, "range": name}
            rows = []
            for model in models:
                of_model = chosen.loc[chosen["model"] == model, "square"]
                rmse = float(np.sqrt(of_model.mean())) if len(of_model) else None
                rows.append(place | {"model": model, "n": len(of_model), "rmse_deg": rmse})
            yield from with_reduction(rows, "rmse_deg")


def classes(share: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> list[str]:
    """Name of the class of each share of the range; each class begins with its lower end."""
    share = np.round(share, DECIMALS)
    lows = [low for low, _ in RANGES.values()]
    last = max(high for _, high in RANGES.values())
    within = np.searchsorted(lows, share, side="right") - 1
    return [CLASSES[one] for one in np.where(share > last, len(RANGES), within)]
