"""The verdict in one sentence, and how sure it is in another."""

from spinepipe.report.discrepancy.verdict import Answer, Missing, Verdict
from spinepipe.report.discrepancy.words import (
    axis,
    called,
    capital,
    listed,
    plain,
    readable,
    what_of,
    where_of,
    with_article,
)
from spinepipe.report.words import fixed, number


def headline(verdict: Verdict) -> str:
    """What is missing and where, or that nothing is, or that nobody can tell."""
    return {
        Answer.NAMED: _named,
        Answer.SET: _one_of,
        Answer.NULL: _nothing,
        Answer.UNKNOWN: _unknown,
    }[verdict.answer](verdict)


def _named(verdict: Verdict) -> str:
    return f"The model lacks {_and(verdict.effects)}."


def _and(effects: tuple[Missing, ...]) -> str:
    return "; and ".join(what_of(effect) for effect in effects)


def _one_of(verdict: Verdict) -> str:
    names = listed([with_article(name) for name in verdict.in_set], 8, "or")
    places = {where_of(one) for one in verdict.candidates}
    where = f", {places.pop()}" if len(places) == 1 and places != {""} else ""
    told = f"one of these is missing{where}, and these tests cannot tell which: {names}."
    if verdict.effects:
        return f"The model lacks {_and(verdict.effects)}. Besides, {told}"
    return capital(told)


def _nothing(verdict: Verdict) -> str:
    gaps = [one.gap for one in verdict.smallest_detectable]
    if not gaps:
        return "Nothing is missing above the noise."
    low, high = number(min(gaps), 2), number(max(gaps), 2)
    most = "" if low == high else f" (the easiest to see) to {high} (the hardest)"
    return (
        "Nothing is missing above the noise. An effect would have been named from a gap of "
        f"{low} noise SD{most}."
    )


def _unknown(verdict: Verdict) -> str:
    if _no_base(verdict):
        return "Nothing can be said of what is missing: the base model cannot be fitted."
    if verdict.suspicions and verdict.why:
        return f"{capital(readable(verdict.why)).rstrip('.')}."
    told = "something is missing that is none of the known effects"
    if not _of_unknown_shape(verdict):
        told = "something is missing, but no name is believed"
    if verdict.effects:
        told = f"The model lacks {_and(verdict.effects)}. Beyond that, {told}"
    first = readable(verdict.unknown_where).split(";")[0].partition(" (gap")[0]
    place = ", ".join(axis(part.replace(" ", "_")) for part in first.split(", "))
    where = f" It shows most at {place}." if first and not first.startswith(_NOWHERE) else ""
    return f"{capital(told)}.{where}"


_NOWHERE = "no single place"


def _of_unknown_shape(verdict: Verdict) -> bool:
    """Whether the reason for no name is what generic shapes explain and known effects do not."""
    why = verdict.why
    return not why or verdict.unknown_shape in why or " stays" in why


def _no_base(verdict: Verdict) -> bool:
    """Whether there is no motion of a base model that measured motion could be held against."""
    return bool(verdict.why) and not verdict.effects and verdict.rms_residual.base is None


def how_sure(verdict: Verdict) -> str:
    """Evidence, margin to the runner-up, and what held-out motion says."""
    parts = [
        *(_evidence(effect, verdict) for effect in verdict.effects),
        _why_unknown(verdict),
        _shape(verdict),
        _misfit(verdict),
        _closed(verdict),
    ]
    return " ".join(part for part in parts if part)


def _evidence(effect: Missing, verdict: Verdict) -> str:
    if effect.log_evidence is None:
        return ""
    told = f"{capital(called(effect))}: log evidence {number(effect.log_evidence)}"
    if verdict.threshold is not None:
        told += f", {number(verdict.threshold, 2)} is needed"
    rivals = [rival for rival in effect.rivals if rival.margin is not None]
    if rivals:
        first = min(rivals, key=lambda rival: rival.margin or 0.0)
        told += f"; next best {plain(first.name)}, {number(first.margin or 0.0, 2)} behind"
    return f"{told}."


def _why_unknown(verdict: Verdict) -> str:
    """Why no name is given, where that is more than the shape of what is missing."""
    shape = verdict.unknown_shape
    if verdict.answer is not Answer.UNKNOWN or not verdict.why or (shape and shape in verdict.why):
        return ""
    if verdict.suspicions and not _no_base(verdict):
        return ""  # the headline says it
    return f"Why no name: {readable(verdict.why).rstrip('.')}."


def _shape(verdict: Verdict) -> str:
    known = verdict.unknown_shape and not _no_base(verdict) and _of_unknown_shape(verdict)
    if verdict.answer is not Answer.UNKNOWN or not known:
        return ""
    shape = readable(verdict.unknown_shape).rstrip(".")
    for spread, words in _SPREADS.items():
        shape = shape.removesuffix(spread) + words if shape.endswith(spread) else shape
    return f"Its shape: {shape}."


_SPREADS = {
    ", each joint of each specimen": ", of its own in each joint of each specimen",
    ", by joint": ", of its own in each joint",
    ", shared": ", alike in all joints and specimens",
}
"""How a shape differs between places, in the words of results and of the page."""


def _misfit(verdict: Verdict) -> str:
    """Residuals in noise SD before and with the effects."""
    rms = verdict.rms_residual
    if rms.base is None:
        return ""
    told = f"Residuals of {fixed(rms.base)} noise SD"
    if rms.with_effects is not None and rms.with_effects != rms.base:
        told += f" become {fixed(rms.with_effects)}"
    return f"{told} (1 is noise)."


def _closed(verdict: Verdict) -> str:
    closed = verdict.gap.held_out_closed
    if closed is None or not (verdict.effects or verdict.candidates):
        return ""
    share = f"{100.0 * closed:.0f} %" if closed < 0.995 else ">99 %"
    share = "100 %" if closed >= 1.0 else share
    before, after = verdict.gap.held_out_base, verdict.gap.held_out_with_effects
    sizes = "" if before is None or after is None else f", {fixed(before)} to {fixed(after)}"
    return f"On motion held out of the fits {share} of the gap is closed{sizes}."
