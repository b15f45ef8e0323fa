"""What to do next: for names that are tied, and for what has none.

Each subject gets every run of the menu with its expected gain, and the best of them is advised.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

from spinepipe.studies.discrepancy.design.information import Bench
from spinepipe.studies.discrepancy.design.next_test import (
    Offer,
    RivalFits,
    offers,
    remaining_chi2,
)
from spinepipe.studies.discrepancy.design.testable import LEAD
from spinepipe.studies.discrepancy.search.outcome import Outcome
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.search_state import SearchResult
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.tables import ADVICE, UNNAMED
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.studies.discrepancy.verdict_unnamed import Reason

ADVISED, OFFERED, TELLS_NOTHING, NO_POSE = ADVICE[:4]

LEAST_GAIN = 0.5
"""Log evidence of a run that tells nothing worth its cycles."""

MOST_PAIRS, MOST_CHECKED = 3, 4
"""Pairs that are asked, and runs of each that are checked by refits."""

BY_REFIT, TO_FIRST_ORDER = "expected, both models refitted", "expected, to first order"


@dataclass(frozen=True)
class Advice:
    """One row: a run about a subject.

    Attributes
    ----------
    subject : two names, or what has none. cycles : all specimens together.
    gain : log evidence; None where it is not known.
    """

    subject: str
    test: str
    cycles: int
    gain: float | None
    status: str
    message: str

    @property
    def per_cycle(self) -> float | None:
        """Gain of each cycle."""
        return None if self.gain is None else self.gain / self.cycles


def advice(
    found: SearchResult, ended: Outcome, place: Bench, run: PieceRunner
) -> tuple[Advice, ...]:
    """All advice; nothing where data or the model's form are wrong, or everything is named."""
    if ended.reason in (Reason.DATA_ERRORS, Reason.MOST_STAYS):
        return ()
    rows = [row for pair in _pairs(found, ended) for row in _of_pair(*pair, place, run)]
    tabled = found.with_tables
    if ended.verdict in (VerdictKind.PART, VerdictKind.UNKNOWN) and tabled is not None:
        # were the table true that stands for something else
        pattern = RivalFits(found.final, found.final.fit, tabled.fit)
        subject = f"{UNNAMED}: {found.lack.shape}"
        rows += _rows(subject, run(offers, (pattern,), place), 0.0)
    return tuple(rows)


Pair = tuple[str, RivalFits, RivalFits, float]


def _pairs(found: SearchResult, ended: Outcome) -> Iterator[Pair]:
    """(subject, two patterns, lead that is missing) of names that are tied."""
    pairs = 0
    for one in found.standing:
        for rival in one.rivals:
            close = one.name in ended.tied and rival.margin < LEAD
            other = _beside_the_rest(found, one.name, rival.name) if close else None
            if other is not None and pairs < MOST_PAIRS:
                pairs += 1
                fits = found.final.fit, other.fit
                yield (
                    f"{one.name} or {rival.name}",
                    RivalFits(found.final, fits[0], fits[1]),
                    RivalFits(found.final, fits[1], fits[0]),
                    LEAD - max(rival.margin, 0.0),
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
