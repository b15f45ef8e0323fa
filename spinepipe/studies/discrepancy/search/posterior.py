"""How probable it is of each effect that it is missing: one posterior over sets of effects.

Hypotheses are sets of effects: none, one, two, three, each with and without *something else*
(`something_else`; where it follows the neighbours or the steps of a test it is seen to first order
only). A set's evidence is that of a joint fit of all its effects, summed over their forms. Fits go
where most probability rests on a first-order look alone, and end where that is little.
"""

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

import numpy as np
from scipy.special import logsumexp

from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.evidence import formula_error, joint_log_evidence
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, Variant
from spinepipe.studies.discrepancy.search.lack_of_fit import OWN, LackOfFit, lack_of_fit
from spinepipe.studies.discrepancy.search.refit import Refit, refit, starting_term
from spinepipe.studies.discrepancy.search.screen import Screen, ScreenedVariant
from spinepipe.studies.discrepancy.search.search_state import ELSE, PRIOR, Rules, look
from spinepipe.studies.discrepancy.search.something_else import TABLE, tables
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import SOMETHING_ELSE, SearchEnd, SearchExtent

ENOUGH = 0.05
"""Probability that may rest on first-order looks alone."""

FAR = 4.0
"""Log odds behind all others from which nothing is looked for beside a set."""

SLACK, SLACK_OF_FORMS, SLACK_OF_TABLE = 0.2, 0.05, 0.4
"""Share of log evidence by which looks may be off: at two effects, at two forms of one, and at a
table and an effect in its place, whose formula bends where the look is straight.
"""

WEAK = 2.0
"""Log evidence up to which a first-order look is as good as a fit."""

FURTHER_FORM = 0.5
"""Probability before any reading that an effect acts in one more form."""

MOST_FORMS, MOST_TABLES = 6, 3
"""In one set; an effect may act in another way on each coordinate."""

MOST_TOLD = 3
"""Sets that were not fitted and are told by name."""

Forms = frozenset[CandidateForm]
Odds = dict[tuple[frozenset[str], bool], float]
"""Logarithms, by names and whether something else is there."""


def names_of(forms: Forms) -> frozenset[str]:
    """Of the effects that have one."""
    return frozenset(form.name for form in forms if form.name != TABLE)


def has_table(forms: Forms) -> bool:
    """Whether something else is among them."""
    return any(form.name == TABLE for form in forms)


@dataclass(frozen=True, eq=False)
class FittedSet:
    """A set of effects, fitted.

    Attributes
    ----------
    baseline : where it stands; None where it has no fit. log_evidence : against the base alone.
    entered : of each of its forms, the set beside which it was looked at, and what was seen.
    refit : how it was fitted; None of the base. screen, lack : looks beside it, where it was
        probable enough for any. reformed : whether it is another form of the same names.
    """

    forms: Forms
    baseline: BaselineFit | None
    log_evidence: float
    entered: Mapping[CandidateForm, "tuple[FittedSet, ScreenedVariant]"]
    refit: Refit | None = None
    screen: Screen | None = None
    lack: LackOfFit | None = None
    reformed: bool = False


@dataclass(frozen=True, eq=False)
class SeenSet:
    """A set of effects that was only looked at.

    Attributes
    ----------
    start : fitted, of which it has ``added`` besides, in the place of ``instead`` if that is not
        None. beside : where it was looked at. log_evidence : predicted. most : what it may be, as
        looks are of first order.
    """

    start: FittedSet
    beside: FittedSet
    added: ScreenedVariant
    instead: CandidateForm | None
    log_evidence: float
    most: float

    @property
    def forms(self) -> Forms:
        """All its forms."""
        return (self.start.forms - {self.instead}) | {self.added.form}

    @property
    def weak(self) -> bool:
        """Whether the look is as good as a fit."""
        return self.added.log_evidence < WEAK


class Posterior:
    """Sets of effects and how probable they are.

    Attributes
    ----------
    fitted : in the order in which they were. seen : those that were only looked at.
    open : probability that may lie in sets that were only looked at, at most. ended : by what.
    """

    def __init__(self, base: BaselineFit, rules: Rules) -> None:
        self.base, self.rules = base, rules
        self.fitted: dict[Forms, FittedSet] = {}
        self.seen: dict[Forms, SeenSet] = {}
        self.open, self.ended = 1.0, SearchEnd.DONE

    @cached_property
    def trials(self) -> Mapping[str, Trials]:
        """All that is tried, by name; something else too."""
        every = (*self.rules.trials, tables(self.base, self.rules.coordinates))
        return {one.effect: one for one in every}

    def explore(self, run: PieceRunner, progress: Progress, until: float | None = None) -> None:
        """Fit sets while much probability rests on looks alone.

        ``until`` : by the clock that never goes back (`time.monotonic`), s; None for no end.
        """
        self._take(FittedSet(frozenset(), self.base, 0.0, {}), run)
        number = 0
        while (best := self._next()) is not None:
            if number >= self.rules.most_fits:
                self.ended = SearchEnd.FITS
                break
            if until is not None and time.monotonic() > until:
                self.ended = SearchEnd.MINUTES
                break
            number += 1
            names = ", ".join(sorted(names_of(best.forms))) or "something else"
            progress.round(
                f"fit {number} of at most {self.rules.most_fits}: {names}; "
                f"{100.0 * self.open:.0f} % of the probability may lie elsewhere"
            )
            del self.seen[best.forms]
            assert best.start.baseline is not None
            term = starting_term(best.added)
            tried = run(refit, self.base.fit, best.start.baseline, term, best.instead)
            usable = np.isfinite(tried.log_evidence)
            at = best.start.baseline.at(tried.fit) if usable else None
            entered = {**best.start.entered, best.added.form: (best.beside, best.added)}
            entered = {form: entered[form] for form in best.forms}
            evidence = tried.log_evidence + self._log_shares(best.forms)
            reformed = best.instead is not None and best.instead.name == best.added.form.name
            one = FittedSet(best.forms, at, evidence, entered, tried, reformed=reformed)
            self._take(one, run)

    def log_evidence_of(self, at: BaselineFit) -> float:
        """Of all effects of a fit, against the base alone."""
        shares = self._log_shares(one.form for one in at.fit.hypothesis.supposed)
        return joint_log_evidence(self.base.fit, at.fit) + formula_error(at) + shares

    def _log_shares(self, forms: Iterable[CandidateForm]) -> float:
        """Of forms, each of its effect."""
        return sum(self.trials[form.name].log_share(form) for form in forms)

    def _next(self) -> SeenSet | None:
        """The set whose fit may matter most; None where no fit does."""
        strong = [one for one in self.seen.values() if not one.weak]
        if not strong:
            self.open = 0.0
            return None
        weak = [self.log_odds_of(one) for one in self.seen.values() if one.weak]
        of_known = logsumexp([*weak, *(self.log_odds_of(one) for one in self.fitted.values())])
        may_be = float(logsumexp([one.most + self.log_prior(one.forms) for one in strong]))
        self.open = float(np.exp(may_be - np.logaddexp(may_be, of_known)))
        if self.open < ENOUGH:
            return None
        return max(
            strong,
            key=lambda one: (
                one.most + self.log_prior(one.forms),
                one.log_evidence,
                sorted(map(repr, one.forms)),
            ),
        )

    @property
    def extent(self) -> SearchExtent:
        """How far it came."""
        strong = [one for one in self.seen.values() if not one.weak]
        strong.sort(key=lambda s: (-s.most - self.log_prior(s.forms), sorted(map(repr, s.forms))))
        sets = [
            (*sorted(names_of(one.forms)), *[SOMETHING_ELSE] * has_table(one.forms))
            for one in strong
        ]
        told = tuple(dict.fromkeys(sets))[:MOST_TOLD] if self.ended is not SearchEnd.DONE else ()
        return SearchExtent(self.ended, len(self.fitted) - 1, self.open, told)

    @property
    def unfitted(self) -> float:
        """Probability of what was only looked at, as the looks have it."""
        looks = [self.log_odds_of(one) for one in self.seen.values() if not one.weak]
        whole = logsumexp([*looks, *(self.log_odds_of(one) for one in self.fitted.values())])
        return float(np.exp(logsumexp(looks) - whole)) if looks else 0.0

    def log_prior(self, forms: Forms) -> float:
        """Of a set of effects, before any reading."""
        names, other = names_of(forms), has_table(forms)
        ways = max(comb(len(self.rules.trials), len(names)), 1)
        more = len(forms) - len(names) - other
        prior = PRIOR[len(names)] / ways * (ELSE if other else 1.0 - ELSE) * FURTHER_FORM**more
        return float(np.log(prior))

    def log_odds_of(self, one: FittedSet | SeenSet) -> float:
        """Logarithm of the posterior odds, less what all sets share."""
        return one.log_evidence + self.log_prior(one.forms)

    def _take(self, one: FittedSet, run: PieceRunner) -> None:
        """Keep a set, and look what else there may be, where it is probable enough."""
        beside = [self.log_odds_of(other) for other in self.fitted.values()]
        probable = not beside or self.log_odds_of(one) > logsumexp(beside) - FAR
        self.fitted[one.forms] = one
        if one.baseline is None or not probable:
            return
        screen = run(look, one.baseline, tuple(self.trials.values()))
        lack = run(lack_of_fit, one.baseline, self.rules.coordinates)
        one = self.fitted[one.forms] = replace(one, screen=screen, lack=lack)
        for seen in (*self._further(one), *self._in_place(one)):
            known = self.seen.get(seen.forms)
            new = known is None or seen.most > known.most
            if new and seen.forms not in self.fitted and self._allowed(seen.forms):
                self.seen[seen.forms] = seen

    def _allowed(self, forms: Forms) -> bool:
        tables_of = sum(form.name == TABLE for form in forms)
        most = min(self.rules.most_effects, len(PRIOR) - 1)
        few = len(names_of(forms)) <= most and len(forms) <= MOST_FORMS
        return few and tables_of <= MOST_TABLES

    def _further(self, one: FittedSet) -> Iterator[SeenSet]:
        """Beside a set."""
        there = {form.variant for form in one.forms}
        for tried in _best_forms(one, there):
            variant = tried.form.variant
            own = (other for other in there if other.effect == variant.effect)
            if variant.effect != TABLE and any(_alike(variant, other) for other in own):
                continue  # two laws of one name on one coordinate are one law
            evidence = one.log_evidence + tried.log_evidence
            yield SeenSet(one, one, tried, None, evidence, evidence)

    def _in_place(self, one: FittedSet) -> Iterator[SeenSet]:
        """In the place of each effect of a set, what was looked at when that entered.

        Looks are of first order: how much they miss is taken to be alike for both. Of a set that is
        itself another form of the same names no more forms are tried: it would be all combinations.
        """
        there = {form.variant for form in one.forms}
        for form, (beside, entered) in one.entered.items():
            known = {form.name}
            for tried in _best_forms(beside, there):
                name = tried.form.name
                if name == form.name and one.reformed:
                    continue
                slack = SLACK_OF_FORMS if name in known else SLACK
                slack = SLACK_OF_TABLE if form.name == TABLE and name != TABLE else slack
                known.add(name)
                lead = entered.log_evidence - tried.log_evidence
                most = one.log_evidence - max(lead - slack * entered.log_evidence, 0.0)
                yield SeenSet(one, beside, tried, form, one.log_evidence - lead, most)

    @property
    def log_odds(self) -> Odds:
        """Of each set of names, with and without something else; less what all sets share.

        Something else counts by its fits or by the first-order look, whichever has more; by its
        fits alone where the look is of what a table can be, and one was fitted beside the set.
        """
        groups: dict[tuple[frozenset[str], bool], list[float]] = {}
        looks: dict[frozenset[str], list[float]] = {}
        every: tuple[FittedSet | SeenSet, ...] = (*self.fitted.values(), *self.seen.values())
        for one in every:
            names, other = names_of(one.forms), has_table(one.forms)
            if np.isfinite(one.log_evidence):
                groups.setdefault((names, other), []).append(self.log_odds_of(one))
            if other or not isinstance(one, FittedSet) or one.lack is None:
                continue
            if not (one.lack.family == OWN and self._tabled(one.forms)):
                more = one.lack.log_evidence + float(np.log(ELSE / (1.0 - ELSE)))
                looks.setdefault(names, []).append(self.log_odds_of(one) + more)
        found = {key: float(logsumexp(of)) for key, of in groups.items()}
        for names, of in looks.items():
            seen = float(logsumexp(of))
            found[names, True] = max(found.get((names, True), -np.inf), seen)
        return found

    def _tabled(self, forms: Forms) -> bool:
        """Whether a table was fitted beside a set."""
        fitted = [one.forms for one in self.fitted.values() if has_table(one.forms)]
        return any({form for form in of if form.name != TABLE} == forms for of in fitted)


def _best_forms(one: FittedSet, there: set[Variant]) -> Iterator[ScreenedVariant]:
    """Each variant as it differs best, by a look beside a set; not those that are there."""
    assert one.screen is not None
    known = set(there)
    for effect in one.screen.effects:
        for tried in effect.forms:  # best first
            if tried.form.variant not in known:
                known.add(tried.form.variant)
                yield tried


def _alike(first: Variant, second: Variant) -> bool:
    """Whether two variants act on the same coordinates, wholly or in part."""
    return bool(set(first.acts_on) & set(second.acts_on)) or first.acts_on == second.acts_on
