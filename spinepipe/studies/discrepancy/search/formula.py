"""A formula for what has no name: the few terms of a joint law that describe what a fit leaves.

Sparse regression (orthogonal matching pursuit) about the fit, base, nuisances and named effects
taken out. The term that explains most enters while it explains more than noise alone shows for the
best of all terms, and a real share of what is above the noise. A term that is a law is then fitted
by the full simulator, along with everything, before the next one is looked for; others stay linear.
Terms that do not predict readings left out are taken back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.proof.formula_folds import ChosenTerm, proof_of_terms
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.law_terms import (
    READING,
    LawTerm,
    TermColumns,
    tell_time,
    term_columns,
)
from spinepipe.studies.discrepancy.search.model_files import standard_errors
from spinepipe.studies.discrepancy.search.prediction import bushing_stiffness
from spinepipe.studies.discrepancy.search.pursuit import (
    EVERYWHERE,
    PursuitProblem,
    Ranked,
    TermAtPlace,
    pursuit_problem,
)
from spinepipe.studies.discrepancy.search.refit import STARTS, standing, weaker
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, FormulaTerm

MOST_TERMS = 4
"""More terms describe anything."""

REAL_SHARE = 0.05
"""Of what is above the noise: what explains less is not worth a place in a formula."""

NEAR, MOST_REFITS = 0.75, 3
"""Laws that explain this share of the best, in the linear problem, are fitted too; so many."""


@dataclass(frozen=True)
class _Term:
    """A term that entered. ``number`` : of its effect in the fit, None where it stays linear."""

    law: LawTerm
    place: TermAtPlace
    number: int | None
    explained: float


@dataclass(frozen=True)
class _FormulaState:
    """Terms so far, the fit with those that are laws, and the problem about it."""

    grounds: BaselineFit
    columns: Mapping[str, TermColumns]
    problem: PursuitProblem
    terms: tuple[_Term, ...]

    @property
    def linear(self) -> list[TermAtPlace]:
        """Terms that no effect says, in order."""
        return [one.place for one in self.terms if one.number is None]


def formula(
    grounds: BaselineFit, coordinates: Sequence[str], draws: int, seed: int, false_alarm: float
) -> Formula | None:
    """What the grounds' fit leaves as a formula; None where no term passes.

    Parameters
    ----------
    draws : of the null; ``false_alarm`` : how often its best term may pass.
    """
    states, threshold = _pursued(grounds, coordinates, draws, seed, false_alarm)
    for state in states[:0:-1]:  # with all terms, then one less
        chosen = [_chosen(state, place) for place in state.linear]
        proof = proof_of_terms(grounds, state.grounds, chosen)
        if proof.beats_base or not proof.tells:
            terms = _told(state)
            whole = min(sum(one.explained for one in terms), 1.0)
            return Formula(terms, text_of(terms), whole, proof.closed, threshold)
    return None


def _pursued(
    grounds: BaselineFit, coordinates: Sequence[str], draws: int, seed: int, false_alarm: float
) -> tuple[list[_FormulaState], float]:
    """States with no term, one and so on; and what the first term had to explain."""

    def about(at: BaselineFit, terms: tuple[_Term, ...]) -> _FormulaState:
        columns = terms_of(at, coordinates)
        return _FormulaState(at, columns, pursuit_problem(at, columns, draws, seed), terms)

    states = [about(grounds, ())]
    excess, threshold = states[0].problem.excess, None
    while len(states) <= MOST_TERMS:
        here = states[-1]
        ranked = here.problem.ranked(here.linear, false_alarm)
        threshold = ranked.threshold if threshold is None else threshold
        if not ranked.drops[0] > max(ranked.threshold, REAL_SHARE * excess):
            break
        after, terms = _with_one_more(here, ranked, excess)
        states.append(about(after, terms))
    assert threshold is not None
    return states, threshold


def terms_of(grounds: BaselineFit, coordinates: Sequence[str]) -> dict[str, TermColumns]:
    """Columns of all terms where the models of a fit stand, by specimen."""
    timed = all(tell_time(one.cases) for one in grounds.readings.values())
    return {
        name: term_columns(
            model,
            grounds.readings[name].cases,
            grounds.noise.zeroed,
            coordinates,
            timed,
            np.where((k := bushing_stiffness(model)) > 0.0, k, 1.0),
        )
        for name, model in grounds.fit.models.items()
    }


def _with_one_more(
    here: _FormulaState, ranked: Ranked, excess: float
) -> tuple[BaselineFit, tuple[_Term, ...]]:
    """The grounds with one term more: the law that fits best, or the leader as it is."""
    leader, drop = ranked.best[0], ranked.drops[0]
    above = max(excess, drop)
    law = here.problem.terms[leader.term]
    if law.variant is not None:
        fitted = _best_fit(here, ranked)
        if fitted is not None:
            at, place = fitted
            number = len(at.fit.hypothesis.supposed) - 1
            gain = (here.grounds.fit.chi2 - at.fit.chi2) / above
            entered = _Term(here.problem.terms[place.term], place, number, gain)
            return at, (*here.terms, entered)
    return here.grounds, (*here.terms, _Term(law, leader, None, drop / above))


def _best_fit(here: _FormulaState, ranked: Ranked) -> tuple[BaselineFit, TermAtPlace] | None:
    """The grounds with the law, of those that lead, that fits best by the full simulator."""
    found: list[tuple[BaselineFit, TermAtPlace]] = []
    tried = 0
    for place, drop, value in zip(ranked.best, ranked.drops, ranked.values, strict=True):
        variant = here.problem.terms[place.term].variant
        if variant is None or drop < NEAR * ranked.drops[0]:
            continue
        tried += 1
        (parameter,) = variant.create().parameters
        start = np.clip([value], 0.5 * parameter.low, 0.5 * parameter.high)
        one = ActiveTerm(_form(variant, place, tuple(here.grounds.readings)), start)
        at = _fit_with(here.grounds, one)
        if at is not None:
            found.append((at, place))
        if tried == MOST_REFITS:
            break
    return min(found, key=lambda pair: pair[0].fit.chi2, default=None)


def _fit_with(grounds: BaselineFit, one: ActiveTerm) -> BaselineFit | None:
    """The grounds with an effect more; None where it has no fit or ends at a bound."""
    before = grounds.fit
    for share in STARTS:
        supposed = (*standing(before), weaker(one, share))
        fit = joint_fit(grounds.suppose(supposed), grounds.setting, before.poses)
        if fit.usable and not fit.at_bound.any() and fit.chi2 < before.chi2:
            return grounds.at(fit)
    return None


def _form(variant: Variant, place: TermAtPlace, specimens: Sequence[str]) -> CandidateForm:
    joint = None if place.joint == EVERYWHERE else place.joint
    specimen = None if place.specimen == EVERYWHERE else specimens[place.specimen]
    if joint is None:
        return CandidateForm(variant, PlaceSpread.SHARED, None, specimen)
    return CandidateForm(
        variant, PlaceSpread.ONE_JOINT if specimen is None else PlaceSpread.ONE, joint, specimen
    )


def _chosen(state: _FormulaState, one: TermAtPlace) -> ChosenTerm:
    """The columns of a candidate as readings, and a prior SD that joints' own loads give."""
    moved, size = {}, 0.0
    for number, (name, of) in enumerate(state.columns.items()):
        if one.specimen in (EVERYWHERE, number):
            joints = of.sizes.shape[1]
            places = list(range(joints)) if one.joint == EVERYWHERE else [one.joint]
            at = [one.term * joints + joint for joint in places]
            moved[name] = tuple(test[..., at].sum(axis=-1) for test in of.moved)
            size = max(size, float(of.sizes[one.term, places].max()))
    return ChosenTerm(moved, size)


def _told(state: _FormulaState) -> tuple[FormulaTerm, ...]:
    """The terms with their values, in the units of tables."""
    fit = state.grounds.fit
    errors = standard_errors(fit)
    straight = iter(zip(*state.problem.fitted(state.linear), strict=True))
    joints = next(iter(fit.models.values())).joints
    specimens = tuple(state.grounds.readings)
    found = []
    for one in state.terms:
        if one.number is None:
            value, sd = next(straight)
        else:
            unknowns = fit.hypothesis.unknowns
            at = next(n for n, u in enumerate(unknowns) if u.supposed == one.number)
            value, sd = fit.hypothesis.supposed[one.number].start[0] + fit.x[at], errors[at]
        place = one.place
        found.append(
            FormulaTerm(
                EVERY[0] if place.specimen == EVERYWHERE else specimens[place.specimen],
                EVERY[0] if place.joint == EVERYWHERE else joints[place.joint],
                one.law.coordinate,
                one.law.acts,
                one.law.words,
                float(value) * one.law.border,
                float(sd) * one.law.border,
                one.law.unit,
                one.explained,
                one.law.of,
            )
        )
    return tuple(found)


def text_of(terms: Sequence[FormulaTerm]) -> str:
    """A piece for each place, its terms one after the other."""
    lines: dict[str, list[str]] = {}
    for one in terms:
        lines.setdefault(_where(one), []).append(
            f"{one.coefficient:+.3g} (SD {one.sd:.2g}) {one.unit} * {one.term}"
        )
    return "; ".join(f"{where} = {' '.join(found)}" for where, found in lines.items())


def _where(one: FormulaTerm) -> str:
    load = "moment" if one.unit.startswith("N m") else "force"
    kind = "drift of the reading" if one.acts == READING else load
    joint = "every joint" if one.joint == EVERY[0] else one.joint
    specimen = "" if one.specimen == EVERY[0] else f" of {one.specimen}"
    return f"{kind} in {one.coordinate.replace('_', ' ')} at {joint}{specimen}"
