"""Where the gap is, in sentences: over all readings, and at the places where it is largest."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from spinepipe.report.words import count, fixed, plain
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.words import motion_of

BASE, WITH_EFFECTS = MODELS

_MOST_PLACES = 3
_BY_CHANCE = 0.025
"""Of places with noise alone, the share whose 95 % interval lies above it."""


def before_and_after(where: pd.DataFrame) -> str:
    """The gap over all readings, without and with the effects."""
    rows = where[(where["by"] == "all") & where["gap"].notna()] if len(where) else where
    sizes = {
        row["model"]: f"{fixed(row['gap'])} ({fixed(row['gap_low'])} to {fixed(row['gap_high'])})"
        for row in rows.to_dict("records")
    }
    if BASE not in sizes:
        return ""
    told = f"Gap over all readings, in noise SD (95 % interval): {sizes[BASE]} with the base"
    after = sizes.get(WITH_EFFECTS, sizes[BASE])
    return f"{told}." if after == sizes[BASE] else f"{told}, {after} with the effects."


def where_most(where: pd.DataFrame) -> str:
    """The places of the largest gap of the base that is above the noise."""
    if where.empty:
        return ""
    chosen, ordered = _at_places(where, BASE), worst(where, BASE)
    if ordered.empty:
        return "Base model and measurement agree within the noise at every joint in every test."
    above = f"{len(ordered)} of {count(len(chosen), 'place')}"
    chance = fixed(_BY_CHANCE * len(chosen), 0)
    return (
        f"Where the base is off most (gap in noise SD, 95 % interval): {places(ordered)}. "
        f"The gap is above the noise at {above}; noise alone would do that at about {chance}."
    )


def worst(where: pd.DataFrame, model: str) -> pd.DataFrame:
    """Places where the gap of a model is above the noise, largest first.

    Parameters
    ----------
    where : rows of the table of that name.
    """
    rows = _at_places(where, model)
    if rows.empty:
        return rows
    return rows[rows["gap_low"] > 0.0].sort_values("gap", ascending=False, kind="stable")


def _at_places(where: pd.DataFrame, model: str) -> pd.DataFrame:
    """Rows of a model at each joint and coordinate in each test."""
    if where.empty:
        return where
    return where[(where["by"] == "joint x coordinate x test") & (where["model"] == model)]


def shown_most(ordered: pd.DataFrame, coordinate: str | None) -> str:
    """The place of the largest gap in a coordinate, if there is one above the noise, else of all.

    Parameters
    ----------
    ordered : places as `worst` has them.
    """
    of_it = ordered[ordered["coordinate"] == coordinate] if len(ordered) else ordered
    rows = (of_it if len(of_it) else ordered).head(1).to_dict("records")
    return _place(rows[0]) if rows else ""


def _place(row: Mapping[Any, Any]) -> str:
    return f"{row['joint']}, {motion_of(row['coordinate'])}, test {plain(row['test'])}"


def places(ordered: pd.DataFrame) -> str:
    """The first of some places, each with its gap."""
    return "; ".join(
        f"{row['joint']} in {motion_of(row['coordinate'])}, test {plain(row['test'])}: "
        f"{fixed(row['gap'], 1)} ({fixed(row['gap_low'], 1)} to {fixed(row['gap_high'], 1)})"
        for row in ordered.head(_MOST_PLACES).to_dict("records")
    )
