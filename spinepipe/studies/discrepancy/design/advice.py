"""What to do next: for names that are tied, for what has none, and for effects that are withheld.

Each subject gets every run of the menu with its expected gain, and the best of them is advised; an
effect that imperfections hide gets what these would have to be known to instead.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

from spinepipe.studies.discrepancy.design.extra_tests import Bench
from spinepipe.studies.discrepancy.design.masked_effects import (
    FACTORS,
    MaskedEffects,
    kinds_of,
    masked_effects,
    with_narrower_priors,
)
from spinepipe.studies.discrepancy.design.next_test import Offer, offers, remaining_chi2
from spinepipe.studies.discrepancy.design.patterns import RivalFits, generic, strengths
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials
from spinepipe.studies.discrepancy.search.lack_of_fit import lack_of_fit
from spinepipe.studies.discrepancy.search.model_files import display_value
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.search_state import Rules, SearchResult
from spinepipe.studies.discrepancy.search.something_else import TABLE
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.tables import ADVICE
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

ADVISED, OFFERED, TELLS_NOTHING, NO_POSE, WOULD_DO, NOT_ENOUGH = ADVICE

LEAST_GAIN = 0.5
"""Log evidence of a run that tells nothing worth its cycles."""

MOST_PAIRS, MOST_CHECKED = 3, 4
"""Pairs that are asked, and runs of each that are checked by refits."""

SET_UP = ("load_axis", "load_gain", "registration")
"""Imperfections that are drawn anew when a specimen is set up anew."""

UNNAMED = "what no effect explains"

BY_REFIT, TO_FIRST_ORDER = "expected, both models refitted", "expected, to first order"


@dataclass(frozen=True)
class Advice:
    """One row: something to do about a subject.

    Attributes
    ----------
    subject : an effect, two names, or what has none. cycles : all specimens together; 0 where it
        is no test. gain : log evidence; None where it is not known.
    """

    subject: str
    test: str
    cycles: int
    gain: float | None
    status: str
    message: str

    @property
    def per_cycle(self) -> float | None:
        """Gain of each cycle; None without cycles."""
        return self.gain / self.cycles if self.gain is not None and self.cycles else None


def advice(
    found: SearchResult,
    ended: Outcome,
    rules: Rules,
    place: Bench,
    run: PieceRunner,
    hidden: Sequence[MaskedEffects],
) -> tuple[Advice, ...]:
    """All advice; nothing where data are wrong or everything is named.

    Parameters
    ----------
    hidden : what `hidden_effects` found.
    """
    if ended.reason is Reason.DATA_ERRORS:
        return ()
    grounds = found.final if ended.named or ended.tied else found.base
    rows = [row for pair in _pairs(found, ended, rules) for row in _of_pair(*pair, place, run)]
    if ended.verdict in (VerdictKind.PART, VerdictKind.UNKNOWN):
        rows += run(_of_unnamed, grounds, rules, place)
    threshold = rules.needed
    for one in hidden:
        rows += _of_withheld(grounds, one, threshold)
    first = {one.effect: one for one in reversed(hidden)}
    for one in list(first.values())[:MOST_PAIRS]:
        trials = next(t for t in rules.trials if t.effect == one.effect)
        rows += run(_of_effect, grounds, trials, one.form, one.sds, place)
    return tuple(rows)


def hidden_effects(
    found: SearchResult, ended: Outcome, rules: Rules, run: PieceRunner
) -> tuple[MaskedEffects, ...]:
    """Effects that are no larger than the imperfections allowed for; none where data are wrong."""
    if ended.reason is Reason.DATA_ERRORS:
        return ()
    named = {one.name for one in ended.named} | set(ended.tied)
    threshold = rules.needed
    grounds = found.final if named else found.base
    return masked_effects(grounds, rules.trials, threshold, sorted(named), run)


Pair = tuple[str, RivalFits, RivalFits, float]


def _pairs(found: SearchResult, ended: Outcome, rules: Rules) -> Iterator[Pair]:
    """(subject, two patterns, margin that is missing) of names that are tied, or nearly lead."""
    pairs = 0
    for one in found.standing:
        for rival in one.rivals:
            close = one.name in ended.tied and rival.margin < rules.margin
            other = _beside_the_rest(found, one.name, rival.name) if close else None
            if other is not None and pairs < MOST_PAIRS:
                pairs += 1
                fits = found.final.fit, other.fit
                yield (
                    f"{one.name} or {rival.name}",
                    RivalFits(found.final, fits[0], fits[1]),
                    RivalFits(found.final, fits[1], fits[0]),
                    rules.margin - max(rival.margin, 0.0),
                )
    if ended.verdict is VerdictKind.UNKNOWN:
        yield from _leading(found, rules)


def _leading(found: SearchResult, rules: Rules) -> Iterator[Pair]:
    """The two effects with most evidence of those that no verdict stands for."""
    first = found.stages[0]
    best: dict[str, Refit] = {}
    for one in first.refits:
        if one.fit.usable and one.name != TABLE and one.log_evidence > rules.needed:
            best.setdefault(one.name, one)
    if len(best) > 1:
        a, b = list(best.values())[:2]
        yield (
            f"{a.name} or {b.name}",
            RivalFits(found.base, a.fit, b.fit),
            RivalFits(found.base, b.fit, a.fit),
            max(rules.margin - (a.log_evidence - b.log_evidence), 0.0),
        )


def _beside_the_rest(found: SearchResult, name: str, rival: str) -> Refit | None:
    """The best refit of a rival in the place of an effect that stands."""
    rest = sorted(one.name for one in found.standing if one.name != name)
    tried = [
        refit
        for stage in found.stages
        for refit in stage.refits
        if refit.name == rival
        and refit.fit.usable
        and sorted(s.form.name for s in refit.fit.hypothesis.supposed) == sorted([*rest, rival])
    ]
    return max(tried, key=lambda refit: refit.log_evidence, default=None)


def _of_pair(
    subject: str,
    first: RivalFits,
    second: RivalFits,
    missing: float,
    place: Bench,
    run: PieceRunner,
) -> list[Advice]:
    """Runs that tell two models apart; the best are checked by refits.

    The others are taken to lose as much by it.
    """
    found = run(offers, (first, second), place)
    likely = [one.words for one in found[:MOST_CHECKED] if (one.gain or 0.0) > LEAST_GAIN]
    checked = _checked((first, second), place, likely, run)
    linear = sum(one.gain or 0.0 for one in found if one.words in checked)
    share = min(1.0, sum(checked.values()) / linear) if linear > 0.0 else 1.0
    corrected = [
        replace(one, gain=checked.get(one.words, None if one.gain is None else share * one.gain))
        for one in found
    ]
    return _rows(subject, corrected, missing, checked)


def _checked(
    pair: tuple[RivalFits, RivalFits], place: Bench, every: Sequence[str], run: PieceRunner
) -> dict[str, float]:
    """Mean gain of each run by refits of both models; of those that both can be asked for."""
    words = [None, *every]  # without any run, and with each
    left = run.map(remaining_chi2, [(one, place, which) for one in pair for which in words])
    gains: dict[str, list[float]] = {name: [] for name in every}
    for start in (0, len(words)):
        now = left[start]
        for name, then in zip(every, left[start + 1 :], strict=False):
            if now is not None and then is not None:
                # the gain of a run: half of what it adds to the chi2 that stays
                gains[name].append(0.5 * max(0.0, then - now))
    return {name: 0.5 * (of[0] + of[1]) for name, of in gains.items() if len(of) == 2}


def _of_unnamed(grounds: BaselineFit, rules: Rules, place: Bench) -> list[Advice]:
    """Runs that show more of what the generic basis sees."""
    lack = lack_of_fit(grounds, rules.coordinates)
    pattern = generic(grounds, rules.coordinates, lack)
    return _rows(f"{UNNAMED}: {lack.shape}", offers([pattern], place), 0.0)


def _rows(
    subject: str, found: Sequence[Offer], missing: float, checked: Collection[str] = ()
) -> list[Advice]:
    """One row per run; the best per cycle is advised, if it tells anything.

    Parameters
    ----------
    missing : log evidence. checked : runs whose gain is by refits.
    """
    ranked = sorted(found, key=lambda one: (-one.per_cycle, one.words))
    rows = []
    for number, one in enumerate(ranked):
        if one.gain is None:
            status = NO_POSE
        elif one.gain < LEAST_GAIN:
            status = TELLS_NOTHING
        else:
            status = OFFERED if number else ADVISED
        message = one.message or (BY_REFIT if one.words in checked else TO_FIRST_ORDER)
        if status == ADVISED and missing > 0.1 and one.gain:
            times = ceil(missing / one.gain)
            often = "once" if times == 1 else f"about {times} times"
            message += f"; {missing:.1f} is missing: do it {often}"
        rows.append(Advice(subject, one.words, one.cycles, one.gain, status, message))
    return rows


def _of_withheld(grounds: BaselineFit, one: MaskedEffects, threshold: float) -> Iterator[Advice]:
    """What an imperfection would have to be known to, for an effect that is no larger."""
    tests = sum(len({case.test for case in r.cases}) for r in grounds.readings.values())
    kind = one.kind
    for factor in FACTORS:
        reached = one.at[factor] > threshold
        told = f"{kind} known {_to(one, factor)}"
        message = (
            f"withheld: no larger than the imperfections allowed for; log evidence {one.now:.1f} "
            f"would be {one.at[factor]:.1f}, {threshold:.1f} is needed"
        )
        yield Advice(
            one.effect,
            told,
            _set_ups(kind, factor) * tests,
            one.at[factor] - one.now,
            WOULD_DO if reached else NOT_ENOUGH,
            message,
        )
    if one.needed is not None:
        again = _set_ups(kind, one.needed)
        how = (
            f"{again} more set-ups of each test, and the mean of them"
            if again
            else "measured again and independently, several times, and the mean of it"
        )
        yield Advice(
            one.effect,
            f"repeated set-ups: {kind} known {_to(one, one.needed)}",
            again * tests,
            threshold - one.now,
            ADVISED,
            f"withheld until {kind} is known {_to(one, one.needed)}: {how}; repeats also measure "
            "how large it really is",
        )


def _set_ups(kind: str, factor: float) -> int:
    """Further set-ups whose mean has that share of the SD; 0 where a set-up draws nothing anew."""
    return ceil(factor**-2.0) - 1 if kind in SET_UP and factor > 0.0 else 0


def _to(one: MaskedEffects, factor: float) -> str:
    """``to 0.5 mm instead of 2 mm``."""
    if not factor:
        return "exactly"
    if one.unit == "1":
        return f"to {100.0 * factor * one.prior:.2g} % instead of {100.0 * one.prior:.2g} %"
    new, unit = display_value(one.unit, factor * one.prior)
    return f"to {new:.2g} {unit} instead of {display_value(one.unit, one.prior)[0]:.2g} {unit}"


def _of_effect(
    grounds: BaselineFit, trials: Trials, form: CandidateForm, sds: tuple[float, ...], place: Bench
) -> list[Advice]:
    """Runs that would show a withheld effect in spite of the imperfections.

    It is as strong as the readings suggest were these known.
    """
    bare = with_narrower_priors(grounds, dict.fromkeys(kinds_of(grounds), 0.0))
    pattern = replace(strengths(bare, trials, form, sds), grounds=grounds)
    return _rows(trials.effect, offers([pattern], place), 0.0)
