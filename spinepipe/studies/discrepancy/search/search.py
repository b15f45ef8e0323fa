"""The search: the posterior of a study, and the model that stands for what is most probable."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import gaps_at, whole_gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.lack_of_fit import lack_of_fit
from spinepipe.studies.discrepancy.search.posterior import (
    FittedSet,
    Odds,
    Posterior,
    has_table,
    names_of,
)
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.search.search_state import (
    Rival,
    Rules,
    SearchResult,
    SearchStage,
    SelectedTerm,
)
from spinepipe.studies.discrepancy.search.something_else import TABLE
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import EVEN, NOTHING, SOMETHING_ELSE

LEAST_TOLD = 1e-4
"""Probability below which a set of names is not told."""


def search(
    base: BaselineFit,
    rules: Rules,
    run: PieceRunner,
    progress: Progress | None = None,
    until: float | None = None,
) -> SearchResult:
    """Effects that the base lacks, each with its probability and its rivals.

    ``until`` : when the clock ends it, see `Posterior.explore`.
    """
    posterior = Posterior(base, rules)
    posterior.explore(run, progress or Progress(), until)
    odds = posterior.log_odds
    total = float(logsumexp(list(odds.values())))
    sets = [(names, other, float(np.exp(v - total))) for (names, other), v in odds.items()]
    sets.sort(key=lambda one: (-one[2], sorted(one[0]), one[1]))
    probabilities = dict.fromkeys(sorted(one.effect for one in rules.trials), 0.0)
    probabilities[SOMETHING_ELSE] = sum(p for _, other, p in sets if other)
    probabilities[NOTHING] = sum(p for names, other, p in sets if not names and not other)
    for names, _, p in sets:
        for name in names:
            probabilities[name] += p

    # names by the sum over with and without something else, which is no name; of those that have
    # a fit
    there = {names_of(o.forms) for o in posterior.fitted.values() if o.baseline is not None}
    by_names = {one: sum(p for names, _, p in sets if names == one) for one in there}
    names = max(there, key=lambda one: (by_names[one], sorted(one)))
    tabled = _likeliest(names, posterior, tables=True)
    likely = tabled if probabilities[SOMETHING_ELSE] >= EVEN else None
    final = _model_of(names, likely, posterior, run)
    lack = run(lack_of_fit, final, rules.coordinates)
    return SearchResult(
        base=base,
        final=final,
        standing=tuple(_standing(final, posterior, odds, probabilities)),
        stages=tuple(_stages(posterior)),
        probabilities=probabilities,
        sets=tuple(one for one in sets if one[2] > LEAST_TOLD),
        with_tables=tabled.baseline if tabled else None,
        lack=lack,
        unfitted=posterior.unfitted,
        base_gap=whole_gap(base, base.fit),
        final_gap=whole_gap(final, final.fit),
        base_at=gaps_at(base, base.fit),
        final_at=gaps_at(final, final.fit),
        extent=posterior.extent,
    )


def _model_of(
    names: frozenset[str], beside: FittedSet | None, posterior: Posterior, run: PieceRunner
) -> BaselineFit:
    """The likeliest model with these effects and no table; the base where it has no fit.

    ``beside`` : the same with tables, whose effects stand where these make it likelier.
    """
    best = _likeliest(names, posterior, tables=False)
    odds = -np.inf if best is None else posterior.log_odds_of(best)
    at = beside.baseline if beside and posterior.log_odds_of(beside) > odds else None
    if at is not None:
        named = [one for one in standing(at.fit) if one.form.name != TABLE]
        fit = run(joint_fit, at.suppose(named), at.setting, None)
        if fit.usable:
            return at.at(fit)
    return posterior.base if best is None or best.baseline is None else best.baseline


def _likeliest(names: frozenset[str], posterior: Posterior, *, tables: bool) -> FittedSet | None:
    """Of the sets of these names, with tables or without."""
    having = [
        one
        for one in posterior.fitted.values()
        if one.baseline is not None
        and names_of(one.forms) == names
        and has_table(one.forms) == tables
    ]
    return max(having, key=lambda o: (o.log_evidence, sorted(map(repr, o.forms))), default=None)


def _standing(
    final: BaselineFit,
    posterior: Posterior,
    odds: Odds,
    probabilities: dict[str, float],
) -> Iterable[SelectedTerm]:
    """What stands in the final model."""
    supposed = standing(final.fit)
    names = frozenset(one.form.name for one in supposed)
    evidence = posterior.log_evidence_of(final)
    for one in supposed:
        name = one.form.name
        # the others alone, or as many of them as were fitted; with no table in the name's place
        without = [
            s
            for s in posterior.fitted.values()
            if (of := names_of(s.forms)) < names
            and name not in of
            and s.baseline is not None
            and not has_table(s.forms)
        ]
        best = max(without, key=lambda s: (len(s.forms), s.log_evidence))
        assert best.baseline is not None
        yield SelectedTerm(
            one,
            probabilities[name],
            evidence - best.log_evidence,
            best.baseline.fit.chi2 - final.fit.chi2,
            _rivals(one, names, odds, posterior),
        )


def _rivals(
    one: ActiveTerm,
    standing: frozenset[str],
    odds: Odds,
    posterior: Posterior,
) -> tuple[Rival, ...]:
    """Others than stand in the place of one, by the odds of all sets that have the one or other."""
    name = one.form.name
    mine = logsumexp([value for (names, _), value in odds.items() if name in names])
    found = []
    for other in sorted({n for names, _ in odds for n in names} - standing):
        instead = [v for (names, _), v in odds.items() if other in names and name not in names]
        if instead:
            best = max(
                (s for s in posterior.fitted.values() if other in names_of(s.forms)),
                key=lambda s: s.log_evidence,
                default=None,
            )
            forms = [form for form in best.forms if form.name == other] if best else []
            on = forms[0].variant.acts_on if forms else ()
            found.append(Rival(other, float(mine - logsumexp(instead)), on))
    return tuple(sorted(found, key=lambda rival: rival.margin))


def _stages(posterior: Posterior) -> Iterable[SearchStage]:
    """Looks in their order, each with the fits that followed it."""
    every = posterior.fitted.values()
    best = max(posterior.log_odds_of(one) for one in every)
    looked = [one for one in every if one.screen is not None]
    for number, parent in enumerate(looked, 1):
        assert parent.screen is not None
        tried = [
            (replace(one.refit, log_evidence=one.log_evidence - parent.log_evidence), one)
            for one in every
            if one.refit is not None and one.entered[one.refit.form][0].forms == parent.forms
        ]
        yield SearchStage(
            str(number),
            parent.screen,
            tuple(refit for refit, _ in tried),
            tuple(best - posterior.log_odds_of(one) for _, one in tried),
            tuple(sorted(form.name for form in parent.forms)),
        )
