"""The verdict in one sentence, how sure it is, and what else a reader should know."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import capital, count, fixed, listed, number
from spinepipe.studies.discrepancy.misfit_words import (
    before_and_after,
    descriptions,
    more_stays,
    of_another_coordinate,
    shape_sentence,
    what_stays,
    where_most,
    without_a_name,
)
from spinepipe.studies.discrepancy.quantities import quantities
from spinepipe.studies.discrepancy.verdict import (
    DECLARED,
    Conclusion,
    Verdict,
    share_of_gap,
)
from spinepipe.studies.discrepancy.verdict_unnamed import Reason
from spinepipe.studies.discrepancy.words import (
    general,
    label_of,
    readable,
    spread_words,
    what_of,
    with_article,
)

_MOST_EASY, _MOST_HARD, _MOST_ALIKE, _MOST_TESTS = 4, 3, 2, 3
_ALIKE = 0.3
"""Share of an effect's gap from which another is said to be like it."""

_MOST_SIZES = 4

USEFUL = ("advised", "offered", "would_do")
"""Status of runs, and of imperfections known better, that would tell something."""

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
    if verdict.verdict is Conclusion.UNKNOWN:
        return without_a_name(verdict, where)
    if verdict.verdict is Conclusion.NULL:
        return _nothing(verdict)
    lacks = f"The model lacks {'; and '.join(what_of(effect) for effect in verdict.effects)}."
    told = lacks
    if verdict.verdict is Conclusion.SET:
        names = [with_article(general(one)) for one in verdict.candidates_in_set]
        one_of = "one of these is missing, and these tests cannot tell which"
        told = f"{one_of}: {listed(names, 8, 'or')}."
        told = f"{lacks} Besides, {told}" if verdict.effects else capital(told)
    return f"{told} {more_stays(verdict, where)}".strip()


def _nothing(verdict: Verdict) -> str:
    gaps = [one.gap for one in verdict.smallest_detectable]
    if not gaps:
        return "Nothing is missing above the noise."
    low, high = number(min(gaps), 2), number(max(gaps), 2)
    most = "" if low == high else f" (the easiest to see) to {high} (the hardest)"
    return (
        "Nothing is missing above the noise. An effect would have been found from a gap of "
        f"{low} noise SD{most}."
    )


def how_sure(verdict: Verdict) -> str:
    """Evidence, margin to the runner-up, and what held-out motion says."""
    parts = []
    for effect in verdict.effects:
        told = f"{capital(label_of(effect))}: log evidence {number(effect.log_evidence)}"
        if verdict.threshold.log_evidence is not None:
            told += f", {number(verdict.threshold.log_evidence, 2)} is needed"
        if effect.rivals:
            first = min(effect.rivals, key=lambda rival: rival.log_evidence_margin)
            behind = number(first.log_evidence_margin, 2)
            told += f"; next best {general(first.name)}, {behind} behind"
        parts.append(f"{told}.")
    # why no name is given, where that is more than the shape of what is missing; of some reasons
    # the headline tells
    if verdict.reason not in (None, Reason.NO_KNOWN_EFFECT, Reason.DATA_ERRORS):
        parts.append(f"Why no name: {readable(verdict.why).rstrip('.')}.")
    if verdict.part is not None and verdict.part.reasons:
        told = "; ".join(readable(one).rstrip(".") for one in verdict.part.reasons)
        parts.append(f"Why that is not all: {told}.")
    parts.append(shape_sentence(verdict))

    # residuals in noise SD before and with the effects
    rms = verdict.rms_residual
    if rms.base is not None:
        told = f"Residuals of {fixed(rms.base)} noise SD"
        if rms.with_effects is not None and rms.with_effects != rms.base:
            told += f" become {fixed(rms.with_effects)}"
        parts.append(f"{told} (1 is noise).")

    gap = verdict.gap
    if gap.held_out_closed is not None and _stands(verdict):
        before, after, sizes = gap.held_out_base, gap.held_out_with_effects, ""
        if before is not None and after is not None:
            sizes = f" from {fixed(before)} to {fixed(after)}"
        share = _share(share_of_gap(gap.held_out_closed))
        parts.append(f"On motion held out of the fits the gap falls{sizes}, by {share}.")
    return " ".join(part for part in parts if part)


def _stands(verdict: Verdict) -> bool:
    """Whether effects are named, or tied."""
    return bool(verdict.effects or verdict.candidates_in_set)


TRAINED_ON = {
    "test": "in tests left out, with fits to the other tests of the same specimens",
    "specimen": "in specimens left out, with their own stiffness and sizes fitted to half of their "
    "load steps",
    "steps": "in load steps left out, with fits to every second one",
}
"""What the fits have seen of a specimen whose motion they predict, by the kind of fold."""


def share_closed_by_kind(verdict: Verdict) -> str:
    """Kinds of folds apart, as their fits have seen more or less of what they predict."""
    closed = [(one.kind, one.excess_closed) for one in verdict.left_out]
    shares = [(kind, share) for kind, share in closed if share is not None]
    if len(shares) < 2 or not _stands(verdict):
        return ""
    told = [
        f"by {_share(share_of_gap(share))} {TRAINED_ON[kind]} "
        f"({_share(share)} of the excess misfit)"
        for kind, share in shares
    ]
    return (
        f"Held out, the gap falls {'; '.join(told)}. The excess misfit (chi squared) is the square "
        "of the gap."
    )


def _share(share: float) -> str:
    return "100 %" if share >= 1.0 else ">99 %" if share >= 0.995 else f"{100.0 * share:.0f} %"


def warnings(verdict: Verdict) -> tuple[str, ...]:
    """Readings that look like errors of the data, which no effect of a model explains."""
    return tuple(
        f"Look at the data first: {readable(one.where)}: {readable(one.what)}"
        + (f" ({readable(one.evidence)})." if one.evidence else ".")
        for one in verdict.suspected_data_errors
    )


def findings(verdict: Verdict, results: ResultTables) -> list[str]:
    """The sentences, without those that there is nothing to say for."""
    where = results.table("where")
    told = [
        *_sizes(verdict),
        detectable_gaps(verdict),
        before_and_after(where),
        share_closed_by_kind(verdict),
        where_most(where),
        what_stays(verdict, where),
        of_another_coordinate(verdict, where),
        *descriptions(verdict),
        similar_effects(verdict, results.table("confusions")),
        nearest_effect(verdict, results.table("candidates")),
        not_testable(verdict),
        *([readable(verdict.imperfections.message)] if verdict.imperfections else []),
        *advice_sentences(results.table("next_tests")),
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
            spread = f"; {spread_words(effect)}" if spread_words(effect) else ""
            told = ", ".join(sizes[:_MOST_SIZES])
            yield f"{capital(label_of(effect))}: {told}{more}{spread}."


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


def detectable_gaps(verdict: Verdict) -> str:
    """Of a search that named nothing: the gaps from which effects would have been found."""
    if verdict.verdict is not Conclusion.NULL or not verdict.smallest_detectable:
        return ""
    ordered = sorted(verdict.smallest_detectable, key=lambda one: one.gap)
    told = [f"{general(one.name)} {number(one.gap, 2)}" for one in ordered]
    if len(told) <= _MOST_EASY + _MOST_HARD:
        return f"Smallest gap, in noise SD, that would have been found: {', '.join(told)}."
    return (
        f"Smallest gap, in noise SD, that would have been found: {', '.join(told[:_MOST_EASY])} "
        f"are the easiest to see; {', '.join(told[-_MOST_HARD:])} the hardest. "
        "A table below has all."
    )


def similar_effects(verdict: Verdict, confusions: pd.DataFrame) -> str:
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
            told.append(f"{listed(alike)} of the gap that {label_of(effect)} makes")
    return f"What it could be taken for with these tests: {'; '.join(told)}." if told else ""


def nearest_effect(verdict: Verdict, candidates: pd.DataFrame) -> str:
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
    if verdict.verdict is Conclusion.NULL:
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


def advice_sentences(next_tests: pd.DataFrame) -> list[str]:
    """The advised test of each subject; nothing where there is no advice."""
    if next_tests.empty:
        return []
    told = []
    for row in next_tests[next_tests["status"] == "advised"].to_dict("records"):
        subject, test = readable(row["effect_or_pair"]), readable(row["test"])
        if row["message"].startswith("withheld"):
            told.append(
                f"{subject.capitalize()} is not named, as it is no larger than the imperfections "
                f"allowed for: {readable(str(row['message']))}."
            )
            continue
        gain = number(float(row["gain_in_log_evidence"]), 2)
        each = count(int(row["cycles"]), "cycle")
        told.append(
            f"Next test for {subject}: {test}; expected gain in log evidence {gain} in {each}."
        )
    # subjects for which no run of the menu tells anything
    helped = next_tests[next_tests["status"].isin(USEFUL)]["effect_or_pair"]
    left = next_tests[~next_tests["effect_or_pair"].isin(helped)]["effect_or_pair"].unique()
    return told + [
        f"No single test that was tried would tell more of {readable(one)}." for one in left
    ]
