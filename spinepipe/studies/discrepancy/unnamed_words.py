"""What has no name, in sentences: that it is there, where, in what shape, and what describes it.

Of an UNKNOWN that is all; of a PART or a SET it is what stays beside what is named.
"""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.words import capital, fixed
from spinepipe.studies.discrepancy.field_tables import formula_text
from spinepipe.studies.discrepancy.gap_words import BASE, WITH_EFFECTS, places, shown_most, worst
from spinepipe.studies.discrepancy.verdict import Verdict
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, Reason
from spinepipe.studies.discrepancy.words import motion_of, readable

_SPREADS = {
    ", each joint of each specimen": ", of its own in each joint of each specimen",
    ", by joint": ", of its own in each joint",
    ", shared": ", alike in all joints and specimens",
}
"""How a shape differs between places, in the words of results and of the page."""


def without_a_name(verdict: Verdict, where: pd.DataFrame) -> str:
    """The headline of what has no name.

    Parameters
    ----------
    where : rows of the table of that name.
    """
    if verdict.reason is Reason.NO_BASE:
        return "Nothing can be said of what is missing: the base model cannot be fitted."
    if verdict.reason is Reason.DATA_ERRORS:
        return f"{capital(readable(verdict.why)).rstrip('.')}."
    told = "Something is missing, but no name is believed."
    if _shape_is_told(verdict):
        told = "Something is missing that is none of the known effects."
    place = shown_most(worst(where, BASE), _coordinate(verdict))
    return f"{told} It shows most at {place}." if place else told


def more_stays(verdict: Verdict, where: pd.DataFrame) -> str:
    """That what is named is not all: how much stays, and where most; empty where nothing does."""
    if verdict.part is None:
        return ""
    gap = verdict.part.left_gap
    size = "" if gap is None else f", a gap of {fixed(gap)} noise SD"
    place = shown_most(worst(where, WITH_EFFECTS), _coordinate(verdict))
    most = f", most at {place}" if place else ""
    told = "That is a part of what is missing: more stays" if verdict.effects else "More stays"
    return f"{told}{size}{most}."


def why_no_name(verdict: Verdict) -> str:
    """Why no name is given, where that is more than the shape of what is missing."""
    if verdict.reason in (None, Reason.NO_KNOWN_EFFECT, Reason.DATA_ERRORS):
        return ""  # or the headline says it
    return f"Why no name: {readable(verdict.why).rstrip('.')}."


def why_not_all(verdict: Verdict) -> str:
    """Why it is not said that nothing else is missing."""
    reasons = () if verdict.part is None else verdict.part.reasons
    told = "; ".join(readable(one).rstrip(".") for one in reasons)
    return f"Why that is not all: {told}." if told else ""


def shape_sentence(verdict: Verdict) -> str:
    """What generic shapes see; empty where they see nothing, or something else is the reason."""
    if verdict.reason is Reason.NO_BASE or not _shape_is_told(verdict):
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
    ordered = worst(where, WITH_EFFECTS)
    if ordered.empty:
        return "With the effects no single place is above the noise by itself."
    return f"What stays with the effects (gap in noise SD, 95 % interval): {places(ordered)}."


def of_another_coordinate(verdict: Verdict, where: pd.DataFrame) -> str:
    """That the shape that is told of is not that of the largest gap, where it is not."""
    coordinate = _coordinate(verdict)
    ordered = worst(where, BASE if verdict.part is None else WITH_EFFECTS)
    if coordinate is None or ordered.empty or ordered["coordinate"].iloc[0] == coordinate:
        return ""
    most = motion_of(ordered["coordinate"].iloc[0])
    return (
        f"The shape that explains most is one of {motion_of(coordinate)}, though the largest gap "
        f"is in {most}: it does not tell what happens in {most}."
    )


def described(verdict: Verdict) -> Iterator[str]:
    """A formula and a table that describe what has no name; neither is one."""
    told = verdict.unknown or verdict.part
    if told is not None and told.formula is not None:
        yield _formula(told.formula)
    table = verdict.tabulated
    if table is not None:
        share = table.held_out_closed
        closed = (
            ""
            if share is None
            else f", and takes away {fixed(100.0 * share, 0)} % of the excess misfit (chi squared) "
            "of readings left out"
        )
        yield (
            f"The model file with the effects has a table in the place of a name "
            f"({readable(table.place)}): it leaves a gap of {fixed(table.gap)} noise SD{closed}."
        )


def _formula(formula: Formula) -> str:
    share = 100.0 * formula.explained
    held_out = formula.held_out_closed
    closed = (
        ""
        if held_out is None
        else f" and {fixed(100.0 * held_out, 0)} % of that of readings left out"
    )
    return (
        f"A formula that describes it, and is no name: {formula_text(formula)}. It explains "
        f"{fixed(share, 0)} % of the excess misfit (chi squared){closed}."
    )


def _shape_is_told(verdict: Verdict) -> bool:
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
    told = verdict.unknown if _shape_is_told(verdict) else None
    return None if told is None else told.coordinate
