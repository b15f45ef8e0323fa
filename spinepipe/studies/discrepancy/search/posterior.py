"""How probable it is of each effect that it is missing: one posterior over sets of effects.

Hypotheses are sets of effects: none, one, two, three, each with and without *something else*
(`something_else`; where it follows the neighbours or the steps of a test it is seen to first order
only). A set's evidence is that of a joint fit of all its effects, summed over their forms. Fits go
where most probability rests on a first-order look alone, and end where that is little.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import comb

import numpy as np
from scipy.special import logsumexp

from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.evidence import formula_error, joint_log_evidence
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit, lack_of_fit
from spinepipe.studies.discrepancy.search.refit import Refit, refit, starting_term
from spinepipe.studies.discrepancy.search.screen import Screen, ScreenedVariant
from spinepipe.studies.discrepancy.search.search_state import ELSE, PRIOR, Rules, look
from spinepipe.studies.discrepancy.search.something_else import TABLE, tables
from spinepipe.studies.discrepancy.store import PieceRunner

ENOUGH = 0.05
"""Probability that may rest on first-order looks alone."""

FAR = 4.0
"""Log odds behind all others from which nothing is looked for beside a set."""

BEYOND = 0.5
"""A fit may come to so much more than the look says, as a share: looks are of first order."""

WEAK = 2.0
"""Log evidence up to which a first-order look is as good as a fit."""

MOST_TABLES = 2

Forms = frozenset[CandidateForm]


def names_of(forms: Forms) -> frozenset[str]:
    """Of the effects that have one."""
    return frozenset(form.name for form in forms if form.name != TABLE)


@dataclass(frozen=True, eq=False)
class FittedSet:
    """A set of effects, fitted.

    Attributes
    ----------
    baseline : where it stands; None where it has no fit. log_evidence : against the base alone.
    parent : the set it was fitted beside. refit : how; None of the base.
    screen, lack : looks beside it, where it was probable enough for any.
    """

    forms: Forms
    baseline: BaselineFit | None
    log_evidence: float
    parent: "FittedSet | None" = None
    refit: Refit | None = None
    screen: Screen | None = None
    lack: LackOfFit | None = None


@dataclass(frozen=True, eq=False)
class SeenSet:
    """A set of effects that was only looked at, beside one that was fitted."""

    forms: Forms
    parent: FittedSet
    added: ScreenedVariant
    most: float

    @property
    def log_evidence(self) -> float:
        """Against the base alone, to first order."""
        return self.parent.log_evidence + self.added.log_evidence

    @property
    def weak(self) -> bool:
        """Whether the look is as good as a fit."""
        return self.added.log_evidence < WEAK


@dataclass
class Posterior:
    """Sets of effects and how probable they are.

    Attributes
    ----------
    fitted : in the order in which they were. seen : those that were only looked at.
    unfitted : probability that rests on looks alone.
    """

    base: BaselineFit
    rules: Rules
    fitted: dict[Forms, FittedSet] = field(default_factory=dict)
    seen: dict[Forms, SeenSet] = field(default_factory=dict)
    unfitted: float = 1.0

    @cached_property
    def trials(self) -> Mapping[str, Trials]:
        """All that is tried, by name; something else too."""
        every = (*self.rules.trials, tables(self.base, self.rules.coordinates))
        return {one.effect: one for one in every}

    def explore(self, run: PieceRunner, progress: Progress) -> None:
        """Fit sets while much probability rests on looks alone."""
        self._take(FittedSet(frozenset(), self.base, 0.0), run)
        for number in range(1, self.rules.most_fits + 1):
            best = self._next()
            if best is None:
                break
            added = ", ".join(sorted(names_of(best.forms))) or "something else"
            progress.round(
                f"fit {number} of at most {self.rules.most_fits}: {added}; "
                f"{100.0 * self.unfitted:.0f} % of the probability is open"
            )
            del self.seen[best.forms]
            beside = best.parent.baseline
            assert beside is not None
            tried = run(refit, self.base.fit, beside, starting_term(best.added))
            shares = sum(self.trials[form.name].log_share(form) for form in best.forms)
            at = beside.at(tried.fit) if np.isfinite(tried.log_evidence) else None
            evidence = tried.log_evidence + shares
            self._take(FittedSet(best.forms, at, evidence, best.parent, tried), run)

    def log_evidence_of(self, at: BaselineFit) -> float:
        """Of all effects of a fit, against the base alone."""
        shares = sum(self.trials[o.form.name].log_share(o.form) for o in at.fit.hypothesis.supposed)
        return joint_log_evidence(self.base.fit, at.fit) + formula_error(at) + shares

    def _next(self) -> SeenSet | None:
        """The set whose fit may matter most; None where no fit does."""
        strong = [one for one in self.seen.values() if not one.weak]
        if not strong:
            self.unfitted = 0.0
            return None
        weak = (one for one in self.seen.values() if one.weak)
        known = [*(self._log_odds(o) for o in self.fitted.values()), *map(self._log_odds, weak)]
        open_ones = logsumexp([one.most + self.log_prior(one.forms) for one in strong])
        self.unfitted = float(np.exp(open_ones - np.logaddexp(open_ones, logsumexp(known))))
        if self.unfitted < ENOUGH:
            return None
        return max(
            strong,
            key=lambda one: (
                one.most + self.log_prior(one.forms),
                one.log_evidence,
                sorted(map(repr, one.forms)),
            ),
        )

    def log_prior(self, forms: Forms) -> float:
        """Of a set of effects, before any reading."""
        count = len(names_of(forms))
        other = any(form.name == TABLE for form in forms)
        ways = max(comb(len(self.rules.trials), count), 1)
        return float(np.log(PRIOR[count] / ways * (ELSE if other else 1.0 - ELSE)))

    def _log_odds(self, one: FittedSet | SeenSet) -> float:
        """Logarithm of the posterior odds, less what all sets share."""
        return one.log_evidence + self.log_prior(one.forms)

    def _take(self, one: FittedSet, run: PieceRunner) -> None:
        """Keep a set, and look what else there may be beside it, where it is probable enough."""
        beside = [self._log_odds(other) for other in self.fitted.values()]
        probable = not beside or self._log_odds(one) > logsumexp(beside) - FAR
        if one.baseline is not None and probable:
            rules = self.rules
            screen = run(look, one.baseline, tuple(self.trials.values()))
            lack = run(lack_of_fit, one.baseline, rules.coordinates)
            one = replace(one, screen=screen, lack=lack)
            for seen in self._beside(one, one.baseline, screen):
                known = self.seen.get(seen.forms)
                if seen.forms not in self.fitted and (known is None or seen.most > known.most):
                    self.seen[seen.forms] = seen
        self.fitted[one.forms] = one

    def _beside(self, one: FittedSet, baseline: BaselineFit, screen: Screen) -> Iterator[SeenSet]:
        """Each variant of each further effect as it differs best, by a look."""
        names = names_of(one.forms)
        tabled = {form.variant for form in one.forms if form.name == TABLE}
        full = len(names) >= min(self.rules.most_effects, len(PRIOR) - 1)
        excess = sum(float(r @ r) for r in baseline.fit.residuals.values())
        for effect in screen.effects:
            if effect.effect == TABLE:
                if len(tabled) >= MOST_TABLES:
                    continue
            elif full or effect.effect in names:
                continue
            known = set(tabled)
            for tried in effect.forms:  # best first
                if tried.form.variant not in known:
                    known.add(tried.form.variant)
                    more = tried.log_evidence + BEYOND * max(tried.log_evidence, 0.0)
                    most = one.log_evidence + min(more, 0.5 * excess)
                    yield SeenSet(one.forms | {tried.form}, one, tried, most)

    @property
    def log_odds(self) -> dict[tuple[frozenset[str], bool], float]:
        """Of each set of names, with and without something else; less what all sets share.

        Something else counts by its fits or by the first-order look, whichever has more.
        """
        groups: dict[tuple[frozenset[str], bool], list[float]] = {}
        looks: dict[frozenset[str], list[float]] = {}
        for one in (*self.fitted.values(), *self.seen.values()):
            names = names_of(one.forms)
            other = any(form.name == TABLE for form in one.forms)
            if np.isfinite(one.log_evidence):
                groups.setdefault((names, other), []).append(self._log_odds(one))
            if isinstance(one, FittedSet) and one.lack is not None and not other:
                with_it = self._log_odds(one) + one.lack.log_evidence + np.log(ELSE / (1.0 - ELSE))
                looks.setdefault(names, []).append(float(with_it))
        found = {key: float(logsumexp(of)) for key, of in groups.items()}
        for names, of in looks.items():
            seen = float(logsumexp(of))
            found[names, True] = max(found.get((names, True), -np.inf), seen)
        return found
