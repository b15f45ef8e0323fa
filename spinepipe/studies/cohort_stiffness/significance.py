"""Do two stiffness sets differ in their errors? Tables 6 and 7 of Gould et al. 2024b."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from spinepipe.jobs.tested_rows import Tested
from spinepipe.report.stage_errors import (
    FITTED,
    LEFT_OUT_SPECIMEN,
    LITERATURE,
    of_single_cases,
)
from spinepipe.statistics import kruskal_wallis, wilcoxon_signed_rank
from spinepipe.units import ROTATIONS

PUBLISHED_OF = {"level_ratio": "literature_levels"}
"""The published set a representation starts from, where it is not ``literature``."""

AS_PUBLISHED = "takes the two fits of a specimen as independent, as published"


def signed_ranks(errors: pd.DataFrame) -> Iterator[Tested]:
    """Wilcoxon tests within each specimen: published against fitted, fitted against predicted.

    Pairs are the absolute errors at the largest load of all rotations of all joints; fits to
    single load cases.
    """
    published, fitted, held_out = (
        of_single_cases(errors, stage) for stage in (LITERATURE, FITTED, LEFT_OUT_SPECIMEN)
    )
    for representation in fitted["representation"].unique():
        start = PUBLISHED_OF.get(representation, "literature")
        own = fitted[fitted["representation"] == representation]
        others = held_out[held_out["representation"] == representation]
        before = published[published["representation"] == start]
        for comparison, first, second in (
            ("literature_against_fitted", before, own),
            ("fitted_against_left_out_specimen", own, others),
        ):
            name = f"signed_rank/{comparison}/{representation}"
            if len(first) and len(second):
                yield from _each_specimen(name, first, second)


def _each_specimen(name: str, first: pd.DataFrame, second: pd.DataFrame) -> Iterator[Tested]:
    """One test per specimen and load case that both have."""
    keys = ["specimen", "test", "joint", "coordinate"]
    pairs = first[[*keys, "peak_error"]].merge(second[[*keys, "peak_error"]], on=keys)
    for (specimen, test), rows in pairs.groupby(["specimen", "test"], sort=False):
        known = rows.dropna().filter(like="peak_error").abs().to_numpy(float)
        outcome = wilcoxon_signed_rank(known[:, 0], known[:, 1])
        family = f"{name}/{test}"
        yield Tested(family, "*", "rotation_error", "stage", str(test), outcome, str(specimen))


def against_level_ratio(errors: pd.DataFrame) -> Iterator[Tested]:
    """One stiffness for all joints against the published ratio of levels, over specimens.

    The errors are root mean squares over joints at the largest load, per rotation and overall;
    fits to single load cases.
    """
    fitted = of_single_cases(errors, FITTED)
    names = ("per_specimen", "level_ratio")
    both = [fitted[fitted["representation"] == name] for name in names]
    if any(part.empty for part in both):
        return
    for test in both[0]["test"].unique():
        first, second = (_rms(part[part["test"] == test]) for part in both)
        for response in (name for name in first if name in second):
            pair = pd.concat([first[response], second[response]], axis=1, join="inner")
            values = pair.to_numpy(float)
            family = f"per_specimen_against_level_ratio/{test}"
            published = kruskal_wallis([values[:, 0], values[:, 1]])
            note = f"{published.message}; {AS_PUBLISHED}"
            paired = wilcoxon_signed_rank(values[:, 0], values[:, 1])
            for outcome in (replace(published, message=note), paired):
                yield Tested(family, "*", response, "representation", "fitted", outcome)


def _rms(rows: pd.DataFrame) -> Mapping[str, pd.Series]:
    """Root mean square over joints by specimen, for each rotation and overall.

    A specimen with an unknown error has none.
    """
    found = {}
    chosen = {name: rows[rows["coordinate"] == name] for name in ROTATIONS}
    for name, part in (*chosen.items(), ("overall", rows)):
        measured = part[part["measured_peak"].notna()]
        squares = (measured["peak_error"].astype(float) ** 2).groupby(measured["specimen"])
        known = squares.count() == squares.size()
        if len(known):
            found[f"{name}_rmse"] = squares.mean()[known].map(np.sqrt)
    return found
