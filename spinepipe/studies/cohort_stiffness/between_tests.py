"""Do errors differ between specimens, or between levels? Table 5 of Gould et al. 2024b."""

from collections.abc import Iterator
from dataclasses import replace

import pandas as pd

from spinepipe.jobs.tested_rows import Tested
from spinepipe.report.stage_errors import (
    FITTED,
    LEFT_OUT_CASE,
    LEFT_OUT_SPECIMEN,
    LITERATURE,
    of_single_cases,
)
from spinepipe.statistics import Outcome, friedman, kruskal_wallis

STAGES = (LITERATURE, FITTED, LEFT_OUT_SPECIMEN, LEFT_OUT_CASE)
GROUPS = {"specimens": "specimen", "levels": "joint"}
BLOCKS = {"specimen": "joint", "joint": "specimen"}
"""In what each factor is seen again and again."""

AS_PUBLISHED = "takes values of the same specimen and joint as independent, as published"


def between_groups(errors: pd.DataFrame) -> Iterator[Tested]:
    """Kruskal-Wallis as published; Friedman, which keeps what belongs together, beside it.

    Fits to single load cases; of a left out load case, fits to all others.
    """
    for stage in STAGES:
        chosen = of_single_cases(errors, stage)
        for (representation, test), rows in chosen.groupby(["representation", "test"], sort=False):
            for what, factor in GROUPS.items():
                family = f"between_{what}/{representation}/{stage}"
                for response, part in responses(rows):
                    for outcome in _both(part, factor):
                        yield Tested(family, "*", response, factor, str(test), outcome)


def responses(rows: pd.DataFrame) -> tuple[tuple[str, pd.DataFrame], ...]:
    """The loaded coordinate alone, and all rotations."""
    return ("loaded_error", rows[rows["loaded"].astype(bool)]), ("rotation_error", rows)


def _both(rows: pd.DataFrame, factor: str) -> Iterator[Outcome]:
    known = rows.dropna(subset="peak_error")
    errors = known["peak_error"].astype(float).abs()
    groups = [part.to_numpy(float) for _, part in errors.groupby(known[factor], sort=False)]
    yield _noted(kruskal_wallis(groups), AS_PUBLISHED)
    block = BLOCKS[factor]
    grid = known.assign(error=errors).pivot(
        index=[block, "coordinate"], columns=factor, values="error"
    )
    complete = grid.dropna()
    lost = len(grid) - len(complete)
    # The coordinates of one block hang together: they count as one, by the mean of their ranks.
    ranks = complete.rank(axis=1).groupby(block, sort=False).mean()
    note = f"{lost} incomplete blocks of a coordinate left out"
    yield _noted(friedman(ranks.to_numpy(float)), note, lost > 0)


def _noted(outcome: Outcome, note: str, when: bool = True) -> Outcome:
    """The outcome with a note in its message."""
    if not when:
        return outcome
    return replace(outcome, message="; ".join(part for part in (outcome.message, note) if part))
