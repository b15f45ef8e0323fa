"""Which rows the bootstrap figure has: what was sampled, how it was loaded, specimen and joint."""

from collections.abc import Sequence
from itertools import product

import pandas as pd

from spinepipe.report.rows import EVERY_JOINT, MOST_ROWS, Rows
from spinepipe.tables.identification import LOADINGS

SAMPLED = {"start": "start", "damping": "damping"}
"""What is sampled, as printed; the first stands on top."""

LOADING_NAMES = {
    "equilibrium": "at rest",
    "quasi_static": "quasi-static",
    "dynamic": "dynamic",
}
FIT = ["specimen", "bootstrap", "loading", "set"]
"""What one fit is known by."""


def bootstrap_rows(
    solved: pd.DataFrame,
    columns: Sequence[str],
    specimens: Sequence[str],
    joints: Sequence[str],
    most: int = MOST_ROWS,
) -> tuple[Rows, bool]:
    """Rows from the bottom up, and whether more than ``most`` of them were pooled.

    Where they were, each specimen and joint is taken relative to its own median: ``columns`` are
    then shares of it for stiffness, and differences from it for errors.
    """
    keys = list(product(SAMPLED, LOADINGS, specimens, reversed(joints)))
    parts = [(key, part) for key in keys if len(part := _part(solved, *key))]
    if len(parts) <= most:
        labels = [_label(*key, len(specimens), len(joints)) for key, _ in reversed(parts)]
        return Rows(tuple(labels), tuple(part for _, part in reversed(parts)), ""), False
    relative = pd.concat([_from_median(part, columns) for _, part in parts])
    groups = [
        ((sampled, loading), part)
        for sampled, loading in reversed(list(product(SAMPLED, LOADINGS)))
        if len(part := relative.query("bootstrap == @sampled and loading == @loading"))
    ]
    labels = [f"{SAMPLED[sampled]}, {LOADING_NAMES[loading]}" for (sampled, loading), _ in groups]
    return Rows(
        tuple(labels), tuple(part for _, part in groups), "specimens and joints pooled"
    ), True


def _part(
    solved: pd.DataFrame, sampled: str, loading: str, specimen: str, joint: str
) -> pd.DataFrame:
    chosen = solved["bootstrap"].eq(sampled) & solved["loading"].eq(loading)
    chosen &= solved["specimen"].eq(specimen)
    if joint == EVERY_JOINT:  # the stiffness is the same in the rows of all joints
        return solved[chosen].drop_duplicates(FIT)
    return solved[chosen & solved["joint"].eq(joint)]


def _from_median(part: pd.DataFrame, columns: Sequence[str]) -> pd.DataFrame:
    moved = part.copy()
    for name in columns:
        middle = part[name].median()
        moved[name] = part[name] - middle if "_error_" in name else part[name] / middle
    return moved


def _label(
    sampled: str, loading: str, specimen: str, joint: str, n_specimens: int, n_joints: int
) -> str:
    words = [SAMPLED[sampled], LOADING_NAMES[loading]]
    words += [specimen] if n_specimens > 1 else []
    words += [joint] if n_joints > 1 else []
    return ", ".join(words)
