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

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof.held_out import ChosenTerm, proof_of_terms
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm
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
from spinepipe.studies.discrepancy.search.projected import SEEN, drawn, taken_out
from spinepipe.studies.discrepancy.search.refit import STARTS, standing, weaker
from spinepipe.studies.discrepancy.search.screen import exceeded
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, FormulaTerm

MOST_TERMS = 4
"""More terms describe anything."""

REAL_SHARE = 0.05
"""Of what is above the noise: what explains less is not worth a place in a formula."""

NEAR, MOST_REFITS = 0.75, 3
"""Laws that explain this share of the best, in the linear problem, are fitted too; so many."""

LEAST_LEFT = 1e-4
"""Share of its square that a term must keep beside all that is taken out, to be a term at all."""

EVERYWHERE = -1
"""In the place of a joint or a specimen: all."""

MOST_RANKED = 20


@dataclass(frozen=True)
class TermAtPlace:
    """A term at a place: number of the term, joint and specimen, or `EVERYWHERE`."""

    term: int
    joint: int
    specimen: int


@dataclass(frozen=True)
class Ranked:
    """The candidates that lead, best first: drop of chi2 and coefficient in SI, each alone.

    ``threshold`` : drop that noise alone seldom shows for the best of all candidates.
    """

    best: tuple[TermAtPlace, ...]
    drops: tuple[float, ...]
    values: tuple[float, ...]
    threshold: float


@dataclass(frozen=True)
class _WhitenedColumns:
    """A specimen: whitened columns (N, C), own unknowns taken out; raw squared norms (C,)."""

    columns: Array
    raw: Array


@dataclass(frozen=True)
class PursuitProblem:
    """What the steps of a pursuit about one fit share.

    Attributes
    ----------
    rows : (S + 1,) where each specimen's rows begin. shared : (N, b) orthonormal, what shared
        unknowns move. errors : (N, 1 + D) the data's residual and draws of the null.
    freedom : readings less unknowns.
    """

    terms: tuple[LawTerm, ...]
    joints: int
    parts: tuple[_WhitenedColumns, ...]
    rows: tuple[int, ...]
    shared: Array
    errors: Array
    freedom: float

    @property
    def excess(self) -> float:
        """Chi2 above what noise makes."""
        return float(self.errors[:, 0] @ self.errors[:, 0]) - self.freedom

    def candidates(self) -> list[TermAtPlace]:
        """Every term at each joint and at all, in all specimens and, where several, in each."""
        places = [EVERYWHERE, *range(self.joints)] if self.joints > 1 else [0]
        several = len(self.parts) > 1
        specimens = [EVERYWHERE, *range(len(self.parts))] if several else [EVERYWHERE]
        return [
            TermAtPlace(term, joint, specimen)
            for specimen in specimens
            for term in range(len(self.terms))
            for joint in places
        ]

    def column(self, one: TermAtPlace) -> Array:
        """(N,) of a candidate."""
        found = np.zeros(self.rows[-1])
        width, place = (self.joints + 1, one.joint + 1) if self.joints > 1 else (1, 0)
        for number, part in enumerate(self.parts):
            if one.specimen in (EVERYWHERE, number):
                rows = slice(self.rows[number], self.rows[number + 1])
                found[rows] = part.columns[:, one.term * width + place]
        return found

    def ranked(self, linear: Sequence[TermAtPlace], false_alarm: float) -> Ranked:
        """The candidates that lead beside terms that are there already."""
        basis, errors = self._beside(linear)
        values, drops = self._drops(basis, errors)
        threshold = exceeded(drops[:, 1:].max(axis=0), false_alarm)
        order = np.argsort(-drops[:, 0], kind="stable")[:MOST_RANKED]
        every = self.candidates()
        return Ranked(
            tuple(every[k] for k in order),
            tuple(drops[order, 0].tolist()),
            tuple(values[order].tolist()),
            float(threshold),
        )

    def fitted(self, linear: Sequence[TermAtPlace]) -> tuple[Array, Array]:
        """Coefficients of terms together, SI, and their SDs."""
        if not linear:
            return np.zeros(0), np.zeros(0)
        columns = np.column_stack([self.column(one) for one in linear])
        columns = columns - self.shared @ (self.shared.T @ columns)
        sizes = np.linalg.norm(columns, axis=0)
        scaled = columns / sizes
        covariance = np.linalg.inv(scaled.T @ scaled)
        values = covariance @ (scaled.T @ self.errors[:, 0]) / sizes
        return values, np.sqrt(np.diagonal(covariance)) / sizes

    def _beside(self, linear: Sequence[TermAtPlace]) -> tuple[Array, Array]:
        """Basis of all that is taken out, and the errors without it."""
        # Gram-Schmidt, so that each candidate's drop is beside all terms that are there already
        basis, errors = self.shared, self.errors
        for one in linear:
            column = self.column(one)
            for _ in range(2):  # once more against rounding
                column = column - basis @ (basis.T @ column)
            column = column / np.linalg.norm(column)
            basis = np.column_stack([basis, column])
            errors = errors - np.outer(column, column @ errors)
        return basis, errors

    def _drops(self, basis: Array, errors: Array) -> tuple[Array, Array]:
        """Coefficients (K,) and drops of chi2 (K, 1 + D) of all candidates, in their order."""
        moments, norms, inside, raws = [], [], [], []
        for number, part in enumerate(self.parts):
            rows = slice(self.rows[number], self.rows[number + 1])
            moments.append(part.columns.T @ errors[rows])
            norms.append(np.sum(part.columns**2, axis=0))
            inside.append(part.columns.T @ basis[rows])
            raws.append(part.raw)
        groups = [tuple(np.sum(of, axis=0) for of in (moments, norms, inside, raws))]
        if len(self.parts) > 1:
            groups += list(zip(moments, norms, inside, raws, strict=True))
        values, drops = [], []
        # of each candidate c: (c'r)^2 / |c|^2, c and r without what is taken out
        for moment, norm, within, raw in groups:
            left = norm - np.sum(within**2, axis=1)
            there = left > LEAST_LEFT * raw
            safe = np.where(there, left, 1.0)
            values.append(np.where(there, moment[:, 0] / safe, 0.0))
            drops.append(np.where(there[:, None], moment**2 / safe[:, None], 0.0))
        return np.concatenate(values), np.concatenate(drops)


def pursuit_problem(
    baseline: BaselineFit, columns: Mapping[str, TermColumns], draws: int, seed: int
) -> PursuitProblem:
    """The problem about the baseline's fit, with draws of the null."""
    taken = taken_out(baseline.fit)
    parts, errors = [], []
    for number, (name, one) in enumerate(columns.items()):
        joints = one.sizes.shape[1]
        plain = baseline.plain[name].noise_only(_with_sums(one, joints))
        white = baseline.setting.whitenings[name].shortened(plain)
        parts.append(_WhitenedColumns(taken[name].out_of(white), np.sum(plain**2, axis=0)))
        drawn_here = drawn(taken[name], draws, np.random.default_rng([seed, number]))
        errors.append(taken[name].out_of(drawn_here))
    shared = _orthonormal(np.concatenate([taken[name].shared for name in columns]))
    # shared unknowns couple the specimens: taken out of all rows together
    every = np.concatenate(errors)
    every = every - shared @ (shared.T @ every)
    fitted = sum(one.own.shape[1] for one in taken.values()) + shared.shape[1]
    rows = tuple(np.cumsum([0, *(len(one) for one in errors)]).tolist())
    first = next(iter(columns.values()))
    joints = first.sizes.shape[1]
    return PursuitProblem(first.terms, joints, tuple(parts), rows, shared, every, rows[-1] - fitted)


def _with_sums(one: TermColumns, joints: int) -> list[Array]:
    """Per test (T, J, 6, C): of each term the column of all joints, then that of each."""
    if joints == 1:
        return list(one.moved)
    found = []
    for moved in one.moved:
        each = moved.reshape(*moved.shape[:-1], -1, joints)
        whole = np.concatenate([each.sum(axis=-1, keepdims=True), each], axis=-1)
        found.append(whole.reshape(*moved.shape[:-1], -1))
    return found


def _orthonormal(columns: Array) -> Array:
    """(N, b) of what columns (N, a) span."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
    left, sizes, _ = svd(scaled)
    basis: Array = left[:, sizes > SEEN * sizes.max(initial=0.0)]
    return basis


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

    baseline: BaselineFit
    columns: Mapping[str, TermColumns]
    problem: PursuitProblem
    terms: tuple[_Term, ...]

    @property
    def linear(self) -> list[TermAtPlace]:
        """Terms that no effect says, in order."""
        return [one.place for one in self.terms if one.number is None]


def formula(
    baseline: BaselineFit, coordinates: Sequence[str], draws: int, seed: int, false_alarm: float
) -> Formula | None:
    """What the baseline's fit leaves as a formula; None where no term passes.

    Parameters
    ----------
    draws : of the null; ``false_alarm`` : how often its best term may pass.
    """
    states, threshold = _pursued(baseline, coordinates, draws, seed, false_alarm)
    for state in states[:0:-1]:  # with all terms, then one less
        chosen = [_chosen(state, place) for place in state.linear]
        proof = proof_of_terms(baseline, state.baseline, chosen)
        if proof.beats_base or not proof.tells:
            terms = _valued_terms(state)
            whole = min(sum(one.explained for one in terms), 1.0)
            return Formula(terms, text_of(terms), whole, proof.closed, threshold)
    return None


def _pursued(
    baseline: BaselineFit, coordinates: Sequence[str], draws: int, seed: int, false_alarm: float
) -> tuple[list[_FormulaState], float]:
    """States with no term, one and so on; and what the first term had to explain."""

    def about(at: BaselineFit, terms: tuple[_Term, ...]) -> _FormulaState:
        columns = terms_of(at, coordinates)
        return _FormulaState(at, columns, pursuit_problem(at, columns, draws, seed), terms)

    states = [about(baseline, ())]
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


def terms_of(baseline: BaselineFit, coordinates: Sequence[str]) -> dict[str, TermColumns]:
    """Columns of all terms where the models of a fit stand, by specimen."""
    timed = all(tell_time(one.cases) for one in baseline.readings.values())
    return {
        name: term_columns(
            model,
            baseline.readings[name].cases,
            baseline.noise.zeroed,
            coordinates,
            timed,
            np.where((k := bushing_stiffness(model)) > 0.0, k, 1.0),
        )
        for name, model in baseline.fit.models.items()
    }


def _with_one_more(
    here: _FormulaState, ranked: Ranked, excess: float
) -> tuple[BaselineFit, tuple[_Term, ...]]:
    """The baseline with one term more: the law that fits best, or the leader as it is."""
    leader, drop = ranked.best[0], ranked.drops[0]
    above = max(excess, drop)
    law = here.problem.terms[leader.term]
    if law.variant is not None:
        fitted = _best_fit(here, ranked)
        if fitted is not None:
            at, place = fitted
            number = len(at.fit.hypothesis.supposed) - 1
            gain = (here.baseline.fit.chi2 - at.fit.chi2) / above
            entered = _Term(here.problem.terms[place.term], place, number, gain)
            return at, (*here.terms, entered)
    return here.baseline, (*here.terms, _Term(law, leader, None, drop / above))


def _best_fit(here: _FormulaState, ranked: Ranked) -> tuple[BaselineFit, TermAtPlace] | None:
    """The baseline with the law, of those that lead, that fits best by the full simulator."""
    found: list[tuple[BaselineFit, TermAtPlace]] = []
    tried = 0
    for place, drop, value in zip(ranked.best, ranked.drops, ranked.values, strict=True):
        variant = here.problem.terms[place.term].variant
        if variant is None or drop < NEAR * ranked.drops[0]:
            continue
        tried += 1
        (parameter,) = variant.create().parameters
        start = np.clip([value], 0.5 * parameter.low, 0.5 * parameter.high)
        form = CandidateForm.at(variant, *_named(place, tuple(here.baseline.readings)))
        at = _fit_with(here.baseline, ActiveTerm(form, start))
        if at is not None:
            found.append((at, place))
        if tried == MOST_REFITS:
            break
    return min(found, key=lambda pair: pair[0].fit.chi2, default=None)


def _fit_with(baseline: BaselineFit, one: ActiveTerm) -> BaselineFit | None:
    """The baseline with an effect more; None where it has no fit or ends at a bound."""
    before = baseline.fit
    for share in STARTS:
        supposed = (*standing(before), weaker(one, share))
        fit = joint_fit(baseline.suppose(supposed), baseline.setting, before.poses)
        if fit.usable and not fit.at_bound.any() and fit.chi2 < before.chi2:
            return baseline.at(fit)
    return None


def _named(place: TermAtPlace, specimens: Sequence[str]) -> tuple[int | None, str | None]:
    """Joint and specimen of a place; None for all."""
    joint = None if place.joint == EVERYWHERE else place.joint
    return joint, None if place.specimen == EVERYWHERE else specimens[place.specimen]


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


def _valued_terms(state: _FormulaState) -> tuple[FormulaTerm, ...]:
    """The terms with their values, in the units of tables."""
    fit = state.baseline.fit
    errors = standard_errors(fit)
    straight = iter(zip(*state.problem.fitted(state.linear), strict=True))
    joints = next(iter(fit.models.values())).joints
    specimens = tuple(state.baseline.readings)
    found = []
    for one in state.terms:
        if one.number is None:
            value, sd = next(straight)
        else:
            unknowns = fit.hypothesis.unknowns
            at = next(n for n, u in enumerate(unknowns) if u.supposed == one.number)
            value, sd = fit.hypothesis.supposed[one.number].start[0] + fit.x[at], errors[at]
        joint, specimen = _named(one.place, specimens)
        found.append(
            FormulaTerm(
                EVERY[0] if specimen is None else specimen,
                EVERY[0] if joint is None else joints[joint],
                one.law.coordinate,
                one.law.acts,
                one.law.words,
                float(value) * one.law.display_per_si,
                float(sd) * one.law.display_per_si,
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
        load = "moment" if one.unit.startswith("N m") else "force"
        kind = "drift of the reading" if one.acts == READING else load
        joint = "every joint" if one.joint == EVERY[0] else one.joint
        specimen = "" if one.specimen == EVERY[0] else f" of {one.specimen}"
        lines.setdefault(
            f"{kind} in {one.coordinate.replace('_', ' ')} at {joint}{specimen}", []
        ).append(f"{one.coefficient:+.3g} (SD {one.sd:.2g}) {one.unit} * {one.term}")
    return "; ".join(f"{where} = {' '.join(found)}" for where, found in lines.items())
