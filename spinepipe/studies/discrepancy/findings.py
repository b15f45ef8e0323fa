"""The verdict in one sentence, how sure it is, and what else a reader should know."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.report.page.document import Results
from spinepipe.report.words import capital, count, fixed, listed, number, plain
from spinepipe.studies.discrepancy.quantities import quantities
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import DECLARED, Answer, Missing, Reason, Verdict
from spinepipe.studies.discrepancy.words import (
    called,
    differing,
    general,
    motion_of,
    readable,
    what_of,
    with_article,
)

BASE, WITH_EFFECTS = MODELS

_SPREADS = {
    ", each joint of each specimen": ", of its own in each joint of each specimen",
    ", by joint": ", of its own in each joint",
    ", shared": ", alike in all joints and specimens",
}
"""How a shape differs between places, in the words of results and of the page."""

_MOST_EASY, _MOST_HARD, _MOST_ALIKE, _MOST_TESTS = 4, 3, 2, 3
_ALIKE = 0.3
"""Share of an effect's gap from which another is said to be like it."""

_MOST_PLACES, _MOST_SIZES = 3, 4
_BY_CHANCE = 0.025
"""Of places with noise alone, the share whose 95 % interval lies above it."""

NUISANCES = (
    "Gaps allow for small errors of posture, frames, joint centres and loads (the study's "
    "nuisances). Model files, and the figure of the gap along the load, do not have them."
)


def headline(verdict: Verdict, where: pd.DataFrame) -> str:
    """What is missing and where, or that nothing is, or that nobody can tell.

    Parameters
    ----------
    where : rows of the table of that name.
    """
    if verdict.verdict is Answer.UNKNOWN:
        return _unknown(verdict, where)
    if verdict.verdict is Answer.NULL:
        return _nothing(verdict)
    if verdict.verdict is Answer.SET:
        return _one_of(verdict)
    told = _lacks(verdict.effects)
    return f"{told} {_stays(verdict, where)}" if verdict.verdict is Answer.PART else told


def _stays(verdict: Verdict, where: pd.DataFrame) -> str:
    """That the effects are not all, how much stays, and where most."""
    told = "That is a part of what is missing: more stays"
    gap = None if verdict.part is None else verdict.part.left_gap
    told += "" if gap is None else f", a gap of {fixed(gap)} noise SD"
    first = _shown_most(_worst(where, WITH_EFFECTS), _coordinate(verdict))
    return f"{told}." if first is None else f"{told}, most at {_place(first)}."


def _unknown(verdict: Verdict, where: pd.DataFrame) -> str:
    if verdict.reason is Reason.NO_BASE:
        return "Nothing can be said of what is missing: the base model cannot be fitted."
    if verdict.reason is Reason.DATA_ERRORS:
        return f"{capital(readable(verdict.why)).rstrip('.')}."
    told = "Something is missing, but no name is believed."
    if _of_unknown_shape(verdict):
        told = "Something is missing that is none of the known effects."
    first = _shown_most(_worst(where), _coordinate(verdict))
    return told if first is None else f"{told} It shows most at {_place(first)}."


def _place(row: Mapping[str, Any]) -> str:
    return f"{row['joint']}, {motion_of(row['coordinate'])}, test {plain(row['test'])}"


def _coordinate(verdict: Verdict) -> str | None:
    """The coordinate that the page describes the shape of, if it does."""
    if verdict.part is not None:
        return verdict.part.coordinate
    told = verdict.unknown if _of_unknown_shape(verdict) else None
    return None if told is None else told.coordinate


def _shown_most(worst: pd.DataFrame, coordinate: str | None) -> Mapping[str, Any] | None:
    """The place of the largest gap above the noise, in the coordinate of the shape if any is."""
    of_shape = worst[worst["coordinate"] == coordinate] if len(worst) else worst
    rows = (of_shape if len(of_shape) else worst).head(1).to_dict("records")
    return {str(key): value for key, value in rows[0].items()} if rows else None


def _of_unknown_shape(verdict: Verdict) -> bool:
    """Whether the reason for no name is what generic shapes explain and known effects do not."""
    return not _shape_of(verdict) or verdict.reason in (
        Reason.NO_KNOWN_EFFECT,
        Reason.A_PART_STAYS,
        Reason.MOST_STAYS,
    )


def _shape_of(verdict: Verdict) -> str:
    """What is missing, or stays, as generic shapes see it; empty where they see nothing."""
    if verdict.part is not None:
        return verdict.part.left_shape or ""
    return "" if verdict.unknown is None else verdict.unknown.shape or ""


def _worst(where: pd.DataFrame, model: str = BASE) -> pd.DataFrame:
    """Of these, those whose gap is above the noise, largest first."""
    rows = _at_places(where, model)
    if rows.empty:
        return rows
    return rows[rows["gap_low"] > 0.0].sort_values("gap", ascending=False, kind="stable")


def _at_places(where: pd.DataFrame, model: str) -> pd.DataFrame:
    """Rows of a model at each joint and coordinate in each test."""
    if where.empty:
        return where
    return where[(where["by"] == "joint x coordinate x test") & (where["model"] == model)]


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


def _one_of(verdict: Verdict) -> str:
    names = listed([with_article(general(one)) for one in verdict.candidates_in_set], 8, "or")
    told = f"one of these is missing, and these tests cannot tell which: {names}."
    return f"{_lacks(verdict.effects)} Besides, {told}" if verdict.effects else capital(told)


def _lacks(effects: tuple[Missing, ...]) -> str:
    return f"The model lacks {'; and '.join(what_of(effect) for effect in effects)}."


def how_sure(verdict: Verdict) -> str:
    """Evidence, margin to the runner-up, and what held-out motion says."""
    parts = [
        *(_evidence(effect, verdict) for effect in verdict.effects),
        _why_unknown(verdict),
        _why_more(verdict),
        _shape(verdict),
        _misfit(verdict),
        _closed(verdict),
    ]
    return " ".join(part for part in parts if part)


def _evidence(effect: Missing, verdict: Verdict) -> str:
    told = f"{capital(called(effect))}: log evidence {number(effect.log_evidence)}"
    if verdict.threshold.log_evidence is not None:
        told += f", {number(verdict.threshold.log_evidence, 2)} is needed"
    if effect.rivals:
        first = min(effect.rivals, key=lambda rival: rival.log_evidence_margin)
        told += f"; next best {general(first.name)}, {number(first.log_evidence_margin, 2)} behind"
    return f"{told}."


def _why_unknown(verdict: Verdict) -> str:
    """Why no name is given, where that is more than the shape of what is missing."""
    if verdict.reason in (None, Reason.NO_KNOWN_EFFECT, Reason.DATA_ERRORS):
        return ""  # or the headline says it
    return f"Why no name: {readable(verdict.why).rstrip('.')}."


def _why_more(verdict: Verdict) -> str:
    """Why it is not said that nothing else is missing."""
    reasons = () if verdict.part is None else verdict.part.reasons
    told = "; ".join(readable(one).rstrip(".") for one in reasons)
    return f"Why that is not all: {told}." if told else ""


def _shape(verdict: Verdict) -> str:
    if verdict.reason is Reason.NO_BASE or not _of_unknown_shape(verdict):
        return ""
    of = "The shape of what stays" if verdict.part is not None else "Its shape"
    shape = readable(_shape_of(verdict)).rstrip(".")
    for spread, words in _SPREADS.items():
        shape = shape.removesuffix(spread) + words if shape.endswith(spread) else shape
    return f"{of}: {shape}." if shape else ""


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
    if closed is None or not (verdict.effects or verdict.candidates_in_set):
        return ""
    share = f"{100.0 * closed:.0f} %" if closed < 0.995 else ">99 %"
    share = "100 %" if closed >= 1.0 else share
    before, after = verdict.gap.held_out_base, verdict.gap.held_out_with_effects
    sizes = "" if before is None or after is None else f", {fixed(before)} to {fixed(after)}"
    return f"On motion held out of the fits {share} of the gap is closed{sizes}."


def warnings(verdict: Verdict) -> tuple[str, ...]:
    """Readings that look like errors of the data, which no effect of a model explains."""
    return tuple(
        f"Look at the data first: {readable(one.where)}: {readable(one.what)}"
        + (f" ({readable(one.evidence)})." if one.evidence else ".")
        for one in verdict.suspected_data_errors
    )


def findings(verdict: Verdict, results: Results) -> list[str]:
    """The sentences, without those that there is nothing to say for."""
    told = [
        *_sizes(verdict),
        would_have_been_seen(verdict),
        _before_and_after(results.table("where")),
        _where(results.table("where")),
        _left(verdict, results.table("where")),
        _of_another_coordinate(verdict, results.table("where")),
        confused(verdict, results.table("confusions")),
        imitating(verdict, results.table("candidates")),
        not_testable(verdict),
        _noise(verdict),
    ]
    said = [sentence.replace(" %", "\u00a0%") for sentence in told if sentence]
    return [*said, NUISANCES] if said else []


def _sizes(verdict: Verdict) -> Iterator[str]:
    """How large each named effect is."""
    for effect in verdict.effects:
        sizes = [one.words for one in quantities(effect)]
        if sizes:
            more = " (more in table 1)" if len(sizes) > _MOST_SIZES else ""
            spread = f"; {differing(effect)}" if differing(effect) else ""
            told = ", ".join(sizes[:_MOST_SIZES])
            yield f"{capital(called(effect))}: {told}{more}{spread}."


def _before_and_after(where: pd.DataFrame) -> str:
    """The gap over all readings, without and with the effects."""
    rows = where[(where["by"] == "all") & where["gap"].notna()] if len(where) else where
    sizes = {
        row["model"]: f"{fixed(row['gap'])} ({fixed(row['gap_low'])} to {fixed(row['gap_high'])})"
        for row in rows.to_dict("records")
    }
    if "base" not in sizes:
        return ""
    told = f"Gap over all readings, in noise SD (95 % interval): {sizes['base']} with the base"
    after = sizes.get("with_effects", sizes["base"])
    return f"{told}." if after == sizes["base"] else f"{told}, {after} with the effects."


def _where(where: pd.DataFrame) -> str:
    """The places of the largest gap of the base that is above the noise."""
    if where.empty:
        return ""
    chosen, ordered = _at_places(where, BASE), _worst(where)
    if ordered.empty:
        return "Base model and measurement agree within the noise at every joint in every test."
    above = f"{len(ordered)} of {count(len(chosen), 'place')}"
    chance = fixed(_BY_CHANCE * len(chosen), 0)
    return (
        f"Where the base is off most (gap in noise SD, 95 % interval): {_places(ordered)}. "
        f"The gap is above the noise at {above}; noise alone would do that at about {chance}."
    )


def _left(verdict: Verdict, where: pd.DataFrame) -> str:
    """The places of the largest gap that stays with the effects."""
    if verdict.part is None:
        return ""
    ordered = _worst(where, WITH_EFFECTS)
    if ordered.empty:
        return "With the effects no single place is above the noise by itself."
    return f"What stays with the effects (gap in noise SD, 95 % interval): {_places(ordered)}."


def _places(ordered: pd.DataFrame) -> str:
    """The first of these places, each with its gap."""
    return "; ".join(
        f"{row['joint']} in {motion_of(row['coordinate'])}, test {plain(row['test'])}: "
        f"{fixed(row['gap'], 1)} ({fixed(row['gap_low'], 1)} to {fixed(row['gap_high'], 1)})"
        for row in ordered.head(_MOST_PLACES).to_dict("records")
    )


def _of_another_coordinate(verdict: Verdict, where: pd.DataFrame) -> str:
    """That the shape that is told of is not that of the largest gap, where it is not."""
    coordinate = _coordinate(verdict)
    worst = _worst(where, BASE if verdict.part is None else WITH_EFFECTS)
    if coordinate is None or worst.empty or worst["coordinate"].iloc[0] == coordinate:
        return ""
    most = motion_of(worst["coordinate"].iloc[0])
    return (
        f"The shape that explains most is one of {motion_of(coordinate)}, though the largest gap "
        f"is in {most}: it does not tell what happens in {most}."
    )


def _noise(verdict: Verdict) -> str:
    noise = verdict.noise
    if not noise.source:
        return ""
    sds = ((noise.rotation_sd_deg, "°"), (noise.translation_sd_mm, " mm"))
    told = [f"{number(value, 2)}{unit}" for value, unit in sds if value is not None]
    size = f" SD of one reading {' and '.join(told)}" if told else ""
    if noise.source == DECLARED:
        return f"Noise:{size}, as declared: no cycle was repeated, so all hangs on that number."
    along = f"correlation from step to step {fixed(noise.serial_correlation)}"
    return f"Noise:{size}, from repeated cycles, {along}."


def would_have_been_seen(verdict: Verdict) -> str:
    """Of a search that named nothing: the gaps from which effects would have been named."""
    if verdict.verdict is not Answer.NULL or not verdict.smallest_detectable:
        return ""
    ordered = sorted(verdict.smallest_detectable, key=lambda one: one.gap)
    told = [f"{general(one.name)} {number(one.gap, 2)}" for one in ordered]
    if len(told) <= _MOST_EASY + _MOST_HARD:
        return f"Smallest gap, in noise SD, that would have been named: {', '.join(told)}."
    return (
        f"Smallest gap, in noise SD, that would have been named: {', '.join(told[:_MOST_EASY])} "
        f"are the easiest to see; {', '.join(told[-_MOST_HARD:])} the hardest. "
        "A table below has all."
    )


def confused(verdict: Verdict, confusions: pd.DataFrame) -> str:
    """What these tests could take each named effect for."""
    told = []
    for effect in verdict.effects if len(confusions) else ():
        rows = confusions[(confusions["effect"] == effect.name) & (confusions["share"] >= _ALIKE)]
        others = rows[rows["other"] != effect.name].sort_values("share", ascending=False)
        alike = [
            f"{with_article(general(row['other']))} would explain {100.0 * row['share']:.0f} %"
            for row in others.head(_MOST_ALIKE).to_dict("records")
        ]
        if alike:
            told.append(f"{listed(alike)} of the gap that {called(effect)} makes")
    return f"What it could be taken for with these tests: {'; '.join(told)}." if told else ""


def imitating(verdict: Verdict, candidates: pd.DataFrame) -> str:
    """Of what no known effect explains: the one that comes nearest, and why it is not named."""
    threshold = verdict.threshold.log_evidence
    if verdict.reason is not Reason.NO_KNOWN_EFFECT or threshold is None or candidates.empty:
        return ""
    rows = candidates[candidates["stage"] == "refit 1"].dropna(subset="log_evidence")
    if rows.empty:
        return ""
    best = max(rows.to_dict("records"), key=lambda row: row["log_evidence"])
    if best["log_evidence"] <= threshold:
        return ""
    return (
        f"Nearest known effect: {general(best['effect'])}, log evidence "
        f"{number(best['log_evidence'])}. Generic shapes without physics explain much more, so it "
        "would only imitate what is missing."
    )


def not_testable(verdict: Verdict) -> str:
    """Effects without a trace in these tests, and the tests that would show them."""
    names = [general(one.name) for one in verdict.not_testable]
    if not names:
        return ""
    told = f"These tests cannot show {listed(names, 8, 'or')}"
    if verdict.verdict is Answer.NULL:
        told += ", so nothing is said about them"
    by_test: dict[str, list[str]] = {}
    for one in verdict.not_testable:
        by_test.setdefault(readable(one.test_that_would_tell), []).append(general(one.name))
    none = by_test.pop("", [])
    would = [f"{listed(shown, 8)}: {test}" for test, shown in by_test.items()]
    parts = [f"{told}."]
    if would:
        parts.append(f"What would show them: {'; '.join(would[:_MOST_TESTS])}.")
    if none:
        parts.append(f"No single addition that was tried shows {listed(none, 8, 'or')}.")
    return " ".join(parts)
