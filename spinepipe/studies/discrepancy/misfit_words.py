"""The misfit in sentences: where it is, and what is said of the part that has no name.

Of an UNKNOWN that part is all; of a PART or a SET it is what stays beside what is named.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.words import capital, count, fixed, plain
from spinepipe.studies.discrepancy.field_tables import formula_text
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import Verdict
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import motion_of, readable

BASE, WITH_EFFECTS = MODELS

_MOST_PLACES = 3
_BY_CHANCE = 0.025
"""Of places with noise alone, the share whose 95 % interval lies above it."""

_SPREADS = {
    ", each joint of each specimen": ", of its own in each joint of each specimen",
    ", by joint": ", of its own in each joint",
    ", shared": ", alike in all joints and specimens",
}
"""How a shape differs between places, in the words of results and of the page."""


def before_and_after(where: pd.DataFrame) -> str:
    """The gap over all readings, without and with the effects.

    Parameters
    ----------
    where : here and below, rows of the table of that name.
    """
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
    every, ordered = len(_at_places(where, BASE)), worst_places(where, BASE)
    if ordered.empty:
        return "Base model and measurement agree within the noise at every joint in every test."
    return (
        f"Where the base is off most (gap in noise SD, 95 % interval): {_first(ordered)}. "
        f"The gap is above the noise at {len(ordered)} of {count(every, 'place')}; noise alone "
        f"would do that at about {fixed(_BY_CHANCE * every, 0)}."
    )


def _at_places(where: pd.DataFrame, model: str) -> pd.DataFrame:
    """Rows of a model at each joint and coordinate in each test."""
    return where[(where["by"] == "joint x coordinate x test") & (where["model"] == model)]


def worst_places(where: pd.DataFrame, model: str) -> pd.DataFrame:
    """Places where the gap of a model is above the noise, largest first."""
    rows = where if where.empty else _at_places(where, model)
    if rows.empty:
        return rows
    return rows[rows["gap_low"] > 0.0].sort_values("gap", ascending=False, kind="stable")


def _first(ordered: pd.DataFrame) -> str:
    """The first of some places, each with its gap."""
    return "; ".join(
        f"{row['joint']} in {motion_of(row['coordinate'])}, test {plain(row['test'])}: "
        f"{fixed(row['gap'], 1)} ({fixed(row['gap_low'], 1)} to {fixed(row['gap_high'], 1)})"
        for row in ordered.head(_MOST_PLACES).to_dict("records")
    )


def _shown_most(verdict: Verdict, where: pd.DataFrame, model: str) -> str:
    """The place of the largest gap of a model, in the coordinate that the page tells of if any
    place there is above the noise; empty where none is.
    """
    ordered, coordinate = worst_places(where, model), _coordinate(verdict)
    if ordered.empty:
        return ""
    of_it = ordered[ordered["coordinate"] == coordinate]
    row = (of_it if len(of_it) else ordered).iloc[0]
    return f"{row['joint']}, {motion_of(row['coordinate'])}, test {plain(row['test'])}"


def without_a_name(verdict: Verdict, where: pd.DataFrame) -> str:
    """The headline of what has no name."""
    if verdict.reason is Reason.NO_BASE:
        return "Nothing can be said of what is missing: the base model cannot be fitted."
    if verdict.reason is Reason.DATA_ERRORS:
        return f"{capital(readable(verdict.why)).rstrip('.')}."
    told = "Something is missing, but no name is believed."
    if _tells_of_shape(verdict):
        told = "Something is missing that is none of the known effects."
    place = _shown_most(verdict, where, BASE)
    return f"{told} It shows most at {place}." if place else told


def more_stays(verdict: Verdict, where: pd.DataFrame) -> str:
    """That what is named is not all: how much stays, and where most; empty where nothing does."""
    if verdict.part is None:
        return ""
    gap = verdict.part.left_gap
    size = "" if gap is None else f", a gap of {fixed(gap)} noise SD"
    place = _shown_most(verdict, where, WITH_EFFECTS)
    most = f", most at {place}" if place else ""
    told = "That is a part of what is missing: more stays" if verdict.effects else "More stays"
    return f"{told}{size}{most}."


def shape_sentence(verdict: Verdict) -> str:
    """What generic shapes see; empty where they see nothing, or something else is the reason."""
    if verdict.reason is Reason.NO_BASE or not _tells_of_shape(verdict):
        return ""
    shape = readable(_shape(verdict)).rstrip(".")
    for spread, words in _SPREADS.items():
        shape = shape.removesuffix(spread) + words if shape.endswith(spread) else shape
    of = "Its shape" if verdict.part is None else "The shape of what stays"
    return f"{of}: {shape}." if shape else ""


def what_stays(verdict: Verdict, where: pd.DataFrame) -> str:
    """The places of the largest gap that stays with the effects."""
    if verdict.part is None or where.empty:
        return ""
    ordered = worst_places(where, WITH_EFFECTS)
    if ordered.empty:
        return "With the effects no single place is above the noise by itself."
    return f"What stays with the effects (gap in noise SD, 95 % interval): {_first(ordered)}."


def of_another_coordinate(verdict: Verdict, where: pd.DataFrame) -> str:
    """That the shape that is told of is not that of the largest gap, where it is not."""
    coordinate = _coordinate(verdict)
    ordered = worst_places(where, BASE if verdict.part is None else WITH_EFFECTS)
    if coordinate is None or ordered.empty or ordered["coordinate"].iloc[0] == coordinate:
        return ""
    most = motion_of(ordered["coordinate"].iloc[0])
    return (
        f"The shape that explains most is one of {motion_of(coordinate)}, though the largest gap "
        f"is in {most}: it does not tell what happens in {most}."
    )


def descriptions(verdict: Verdict) -> Iterator[str]:
    """A formula and a table that describe what has no name; neither is one."""
    told = verdict.unknown or verdict.part
    formula, table = None if told is None else told.formula, verdict.tabulated
    if formula is not None:
        share = formula.held_out_closed
        closed = "" if share is None else f" and {_percent(share)} of that of readings left out"
        yield (
            f"A formula that describes it, and is no name: {formula_text(formula)}. It explains "
            f"{_percent(formula.explained)} of the excess misfit (chi squared){closed}."
        )
    if table is not None:
        share, closed = table.held_out_closed, ""
        if share is not None:
            takes = f"takes away {_percent(share)} of the excess misfit (chi squared)"
            closed = f", and {takes} of readings left out"
        yield (
            f"The model file with the effects has a table in the place of a name "
            f"({readable(table.place)}): it leaves a gap of {fixed(table.gap)} noise SD{closed}."
        )


def _percent(share: float) -> str:
    return f"{fixed(100.0 * share, 0)} %"


def _tells_of_shape(verdict: Verdict) -> bool:
    """Whether what generic shapes explain and known effects do not is what there is to say."""
    return (
        verdict.part is not None
        or not _shape(verdict)
        or verdict.reason in (Reason.NO_KNOWN_EFFECT, Reason.A_PART_STAYS, Reason.MOST_STAYS)
    )


def _shape(verdict: Verdict) -> str:
    """What is missing, or stays, as generic shapes see it; empty where they see nothing."""
    if verdict.part is not None:
        return verdict.part.left_shape or ""
    return "" if verdict.unknown is None else verdict.unknown.shape or ""


def _coordinate(verdict: Verdict) -> str | None:
    """The coordinate of the shape that the page tells of; None where it tells of none."""
    if verdict.part is not None:
        return verdict.part.coordinate
    told = verdict.unknown if _tells_of_shape(verdict) else None
    return None if told is None else told.coordinate
