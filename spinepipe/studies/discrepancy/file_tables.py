"""Tables of the result files as the page of a search shows them: in plain words, and shorter."""

import json
from collections.abc import Iterator

import pandas as pd

from spinepipe.report.discrepancy.words import axis, plain
from spinepipe.report.page.results import Results
from spinepipe.tables import CANDIDATES, HELD_OUT, WHERE
from spinepipe.tables.schema import Column

Parts = tuple[str, str, str, pd.DataFrame, tuple[Column, ...]]

_TRIED = ("stage", "effect", "variant", "spread", "scope", "estimate", "unit", "log_evidence",
          "delta_chi2", "gap_share", "message")  # fmt: skip
"""Columns of what was tried; the others are in the file."""

_ONE_PLACE = "joint x coordinate x test"


def file_tables(results: Results) -> Iterator[Parts]:
    """File, title, what is said of it, rows and columns of each table."""
    held_out, where = results.table("held_out"), results.table("where")
    yield "held_out", "Held-out proof", HELD_OUT.about, _worded(held_out), HELD_OUT.columns
    if len(where):
        yield "where", "Where the models are off", _WHERE, _worded(_above(where)), WHERE.columns
    candidates = results.table("candidates")
    if len(candidates):
        columns = tuple(column for column in CANDIDATES.columns if column.name in _TRIED)
        yield "candidates", "What was tried", _CANDIDATES, _worded(_best(candidates)), columns


_WHERE = (
    f"{WHERE.about} Largest first; of single places those above the noise. All of them, and load "
    "steps, are in where.parquet."
)
_CANDIDATES = (
    f"{CANDIDATES.about} On each screen the best form of an effect; all forms are in "
    "candidates.parquet."
)


def _above(where: pd.DataFrame) -> pd.DataFrame:
    """Without load steps, and without single places where noise may be all."""
    kept = (where["by"] != "step") & ((where["by"] != _ONE_PLACE) | (where["gap_low"] > 0.0))
    return where[kept].sort_values("gap", ascending=False, kind="stable")


def _best(candidates: pd.DataFrame) -> pd.DataFrame:
    """Stages in their order, in each the best first; of the screens one form of each effect."""
    rows = candidates[candidates["log_evidence"].notna()]
    order = {stage: number for number, stage in enumerate(rows["stage"].unique())}
    ordered = rows.assign(order=rows["stage"].map(order)).sort_values(
        ["order", "log_evidence"], ascending=[True, False], kind="stable"
    )
    again = ordered.duplicated(["stage", "effect"]) & ordered["stage"].str.startswith("screen")
    return ordered[~again]


def _worded(frame: pd.DataFrame) -> pd.DataFrame:
    """Effects, places and options in plain words."""
    ways = {"effect": plain, "fold": plain, "test": plain, "model": plain, "coordinate": axis,
            "variant": _options}  # fmt: skip
    return frame.assign(**{name: frame[name].map(way) for name, way in ways.items()
                           if name in frame})  # fmt: skip


def _options(text: str) -> str:
    """``flexion-extension, tangent`` of options as JSON."""
    values = [
        name
        for value in json.loads(text).values()
        for name in (value if isinstance(value, list) else [value])
    ]
    return ", ".join(axis(str(name)) for name in values)
