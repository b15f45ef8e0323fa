"""The verdict in one sentence, and how sure it is in another."""

from spinepipe.report.discrepancy.verdict import Answer, Missing, Verdict
from spinepipe.report.discrepancy.words import listed, plain, what_of, where_of, with_article
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
    return told[:1].upper() + told[1:]


def _nothing(verdict: Verdict) -> str:
    gaps = [one.gap for one in verdict.smallest_detectable]
    if not gaps:
        return "Nothing is missing above the noise."
    low, high = number(min(gaps), 2), number(max(gaps), 2)
    most = (
        f"{low} to {high} noise SD, depending on the effect" if low != high else f"{low} noise SD"
    )
    return f"Nothing is missing above the noise. A gap would have been named from {most}."


def _unknown(verdict: Verdict) -> str:
    told = "Something is missing that is none of the known effects"
    where = f": {verdict.unknown_where}" if verdict.unknown_where else ""
    if verdict.effects:
        beside = f"Beyond that, {told[:1].lower()}{told[1:]}"
        return f"The model lacks {_and(verdict.effects)}. {beside}{where}."
    return f"{told}{where}."


def how_sure(verdict: Verdict) -> str:
    """Evidence, margin to the runner-up, and what held-out motion says."""
    parts = [
        *(_evidence(effect, verdict) for effect in verdict.effects),
        _shape(verdict),
        _misfit(verdict),
        _closed(verdict),
    ]
    return " ".join(part for part in parts if part)


def _evidence(effect: Missing, verdict: Verdict) -> str:
    if effect.log_evidence is None:
        return ""
    name = plain(effect.name)
    told = f"{name[:1].upper()}{name[1:]}: log evidence {number(effect.log_evidence)}"
    if verdict.threshold is not None:
        told += f", {number(verdict.threshold, 2)} is needed"
    rivals = [rival for rival in effect.rivals if rival.margin is not None]
    if rivals:
        first = min(rivals, key=lambda rival: rival.margin or 0.0)
        told += f"; next best {plain(first.name)}, {number(first.margin or 0.0, 2)} behind"
    return f"{told}."


def _shape(verdict: Verdict) -> str:
    if verdict.answer is not Answer.UNKNOWN or not verdict.unknown_shape:
        return ""
    return f"Its shape: {verdict.unknown_shape.rstrip('.')}."


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
    if closed is None:
        return ""
    share = f"{100.0 * closed:.0f} %" if closed < 0.995 else ">99 %"
    share = "100 %" if closed >= 1.0 else share
    return f"On motion held out of the fits {share} of the gap is closed."
