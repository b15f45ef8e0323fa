"""Nonlinear refits of the forms that lead the screen, with their evidence by Laplace's method."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from spinepipe.effects import Parameter, PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import (
    STRENGTH_SDS,
    ActiveTerm,
    CandidateForm,
    Trials,
    Variant,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, joint_fit
from spinepipe.studies.discrepancy.search.screen import SIZES, Screen, Screened, ScreenedVariant
from spinepipe.studies.discrepancy.store import PieceRunner

SMALLEST_START = 0.02
"""Prior SDs from off at which a strength starts at least, so that its shapes have a say."""

STARTS = (1.0, 0.5, 0.2)
"""Shares of the strength on the screen at which fits start, one after the other."""

MOST_EFFECTS, MOST_FORMS = 4, (3, 3, 1, 1)
"""Effects that lead the screen, and forms of each, that are refitted."""

ANOTHER_FORM = 3.0
"""Log evidence by which a form with more unknowns must be better than a plainer one."""

SCREEN_SHARE, SCREEN_MARGIN = 0.75, 6.0
"""The screen is linear: an effect may trail the leader by this share of its evidence and more."""


@dataclass(frozen=True)
class Refit:
    """A form beside those of the fit before, refitted with all unknowns.

    Attributes
    ----------
    log_evidence : against the fit before, the form's share of its effect taken off.
    gain : drop of chi2.
    """

    form: CandidateForm
    fit: JointFit
    log_evidence: float
    gain: float

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.form.name

    @property
    def unknowns(self) -> int:
        """Numbers that the form adds to what is fitted."""
        unknowns = self.fit.hypothesis.unknowns
        return sum(one.supposed == len(self.fit.hypothesis.supposed) - 1 for one in unknowns)


def refits(
    baseline: BaselineFit,
    screen: Screen,
    trials: Sequence[Trials],
    run: PieceRunner,
    progress: Progress,
) -> tuple[Refit, ...]:
    """The leading effects of a screen, refitted beside those of the baseline's fit; best first."""
    by_name = {one.effect: one for one in trials}
    there = {one.form.variant for one in standing(baseline.fit)}
    new = [tried for tried in leading(screen) if tried.form.variant not in there]
    if new:
        progress.round(f"{len(new)} forms are refitted")
    found = run.map(refit, [(baseline, starting_term(t), by_name[t.form.name]) for t in new])
    simpler = list(_simpler(found, screen, standing(baseline.fit)))
    found += run.map(refit, [(baseline, one, by_name[one.form.name]) for one in simpler])
    return rank_refits(found)


def rank_refits(found: Sequence[Refit]) -> tuple[Refit, ...]:
    """Refits, best first; of one effect's forms that are hardly behind the best, the plainest.

    What an effect is in a specimen that was not measured, a form with values of their own for each
    specimen tells badly: where the data hardly ask for it, equal values predict better.
    """
    # of each effect the form with the fewest unknowns, of those near its best one
    ranked = sorted(found, key=lambda one: -one.log_evidence)
    first: dict[str, Refit] = {}
    for one in ranked:
        best = next(other for other in ranked if other.name == one.name)
        near = one.log_evidence > best.log_evidence - ANOTHER_FORM
        if near and one.unknowns < first.get(one.name, best).unknowns:
            first[one.name] = one
    # it moves up to where its effect's best one stood
    taken: set[str] = set()
    result: list[Refit] = []
    for one in ranked:
        if one.name not in taken and one.name in first:
            result.append(first[one.name])
        taken.add(one.name)
        if one is not first.get(one.name):
            result.append(one)
    return tuple(result)


def _simpler(
    found: Sequence[Refit], screen: Screen, before: Sequence[ActiveTerm]
) -> Iterator[ActiveTerm]:
    """The leading refits of two effects with values the same everywhere, where not tried yet."""
    ranked = sorted(found, key=lambda one: -one.log_evidence)
    best = list({one.name: one for one in reversed(ranked)}.values())[::-1][:2]
    tried = {one.form for one in found}
    for one in best:
        possible = next(e for e in screen.effects if e.effect == one.name).forms
        for form in (t.form for t in possible):
            simple = form.variant == one.form.variant and form.spread is PlaceSpread.SHARED
            if simple and form not in tried and np.isfinite(one.log_evidence):
                fitted = standing(one.fit)[len(before)]
                yield replace(fitted, form=form)


def laplace(fit: JointFit, number: int, gain: float) -> float:
    """Log evidence for one supposed effect of a fit, whose unknowns lower chi2 by ``gain``.

    Laplace's method (Kass and Raftery 1995, doi 10.2307/2291091): the likelihood is taken for
    normal around the fit, a from off with curvature A. With the prior N(off, S) the evidence is
    gain / 2 - log det(I + A S) / 2 - a' (A^-1 + S)^-1 a / 2. Strengths have prior SDs of t,
    averaged over the sizes t of the screen, shapes those that they declare. Signed strengths have
    half a normal as prior, which adds log 2 + log Phi(mean / sd) of the posterior: see `Group`.
    """
    unknowns = fit.hypothesis.unknowns
    own = np.array([u.supposed == number for u in unknowns])
    curvature = curvature_of(fit, own)
    chosen = [u for u in unknowns if u.supposed == number]
    away = fit.x[own] - np.array([u.mean for u in chosen])  # a: off is the mean of the prior
    is_strength = np.array([u.is_strength for u in chosen])
    declared = np.array([u.sd / STRENGTH_SDS if u.is_strength else u.sd for u in chosen])
    parameters = fit.hypothesis.supposed[number].form.variant.create().parameters
    sides = np.array([parameters[u.column].side for u in chosen])
    found = []
    for size in SIZES:
        sd = np.where(is_strength, size, 1.0) * declared
        spread = np.eye(len(sd)) + curvature * sd**2
        _, logdet = np.linalg.slogdet(spread)
        # (I + A S)^-1 A = (A^-1 + S)^-1, without the inverse of a curvature that may be singular
        fit_to_prior = away @ np.linalg.solve(spread, curvature @ away)
        posterior = np.linalg.inv(curvature + np.diag(sd**-2.0))
        mean = posterior @ (curvature @ away)
        inside = sides * mean / np.sqrt(np.diagonal(posterior))
        half = np.where(sides != 0.0, np.log(2.0) + log_ndtr(inside), 0.0)
        found.append(-0.5 * (logdet + fit_to_prior) + float(half.sum()))
    return 0.5 * gain + float(logsumexp(found)) - float(np.log(len(SIZES)))


def in_place(fit: JointFit, number: int) -> tuple[float, float]:
    """Drop of chi2 by one supposed effect, and its log evidence, both to second order at the fit.

    For an effect without which the others have no fit that it could be compared with.
    """
    own = np.array([u.supposed == number for u in fit.hypothesis.unknowns])
    off = np.array([u.mean for u in fit.hypothesis.unknowns])
    away = (fit.x - off)[own]
    gain = float(away @ curvature_of(fit, own) @ away)
    return gain, laplace(fit, number, gain)


def curvature_of(fit: JointFit, own: NDArray[np.bool_]) -> Array:
    """(k, k) curvature of half chi2 by some unknowns, all others free (and weakly held)."""
    # the Schur complement of J'J + P in the others, by their QR: P is square of their priors
    jacobian = fit.whole_jacobian()
    priors = np.diag([1.0 / u.sd for u in fit.hypothesis.unknowns])
    others = np.vstack([jacobian[:, ~own], priors[np.ix_(~own, ~own)]])
    mine = np.vstack([jacobian[:, own], np.zeros((int((~own).sum()), int(own.sum())))])
    basis, _ = np.linalg.qr(others)
    left = mine - basis @ (basis.T @ mine)
    result: Array = left.T @ left
    return result


def leading(screen: Screen) -> Iterator[ScreenedVariant]:
    """Forms worth a refit."""
    least = _least(screen.effects[0].log_evidence)
    for place, one in enumerate(screen.effects[:MOST_EFFECTS]):
        if one.log_evidence > least:
            yield from _forms(one, MOST_FORMS[place])


def _least(best: float) -> float:
    """Evidence on the screen from which a refit may still win."""
    return max(0.0, best - SCREEN_MARGIN - SCREEN_SHARE * best)


def _forms(one: Screened, most: int) -> list[ScreenedVariant]:
    """The best form of each leading variant, and that of equal values where it is another.

    Variants that are alike while weak (shapes of stiffening) part only in the refit.
    """
    best = one.forms[0]
    least = _least(best.log_evidence)
    by_variant: dict[Variant, ScreenedVariant] = {}
    for tried in one.forms:
        if tried.log_evidence > least:
            by_variant.setdefault(tried.form.variant, tried)
    chosen = list(by_variant.values())[:most]
    for tried in one.forms:
        same = tried.form.variant == best.form.variant and tried.form.spread is PlaceSpread.SHARED
        if same and tried not in chosen and tried.log_evidence > least:
            chosen.append(tried)
    return chosen


def starting_term(tried: ScreenedVariant) -> ActiveTerm:
    """The form with the typical strengths and the shapes that the screen suggests."""
    variant = tried.form.variant
    parameters = variant.create().parameters
    values = variant.off(tried.sds)
    for column in variant.strengths:
        of_column = [e for e, c in zip(tried.estimate, tried.strengths, strict=True) if c == column]
        values[column] = _value(parameters[column], float(np.mean(of_column)))
    return ActiveTerm(tried.form, values)


def _value(p: Parameter, sds: float) -> float:
    """A strength that many prior SDs from off, a little at least, inside its bounds."""
    assert p.off is not None
    side = p.side or float(np.sign(sds) or 1.0)
    away = side * max(abs(sds), SMALLEST_START) * p.prior_scale
    value = p.off * np.exp(away) if p.logarithmic else p.off + away
    margin = min(1e-3 * (p.high - p.low), SMALLEST_START * p.prior_scale)
    return float(np.clip(value, p.low if p.logarithmic else p.low + margin, p.high - margin))


def refit(baseline: BaselineFit, one: ActiveTerm, trials: Trials) -> Refit:
    """One more form beside those of the baseline's fit.

    What tips the segment over where it starts is tried again closer to off.
    """
    before = baseline.fit
    for share in STARTS:
        supposed = (*standing(before), weaker(one, share))
        fit = joint_fit(baseline.suppose(supposed), baseline.setting, before.poses)
        if fit.usable:
            break
    if not fit.usable or _degenerate(fit, len(supposed) - 1):
        return Refit(one.form, fit, -np.inf, -np.inf)
    gain = before.chi2 - fit.chi2
    log_evidence = laplace(fit, len(supposed) - 1, gain) + trials.log_share(one.form)
    return Refit(one.form, fit, log_evidence, gain)


def _degenerate(fit: JointFit, number: int) -> bool:
    """Whether a shape has run to its bound: the effect is then no more what its name says.

    A neutral zone as wide as the motion is a softer joint, a stop without a gap an asymmetry. Where
    a shape spans a family of laws, both its ends are laws of that name.
    """
    parameters = fit.hypothesis.supposed[number].form.variant.create().parameters
    shapes = [
        u.supposed == number and not u.is_strength and not parameters[u.column].family
        for u in fit.hypothesis.unknowns
    ]
    return bool(fit.at_bound[shapes].any())


def weaker(one: ActiveTerm, share: float) -> ActiveTerm:
    """The same, started at a share of the way from off."""
    parameters, start = one.form.variant.create().parameters, one.start.copy()
    for column in one.form.variant.strengths:
        p = parameters[column]
        assert p.off is not None
        away = start[column] / p.off if p.logarithmic else start[column] - p.off
        start[column] = p.off * away**share if p.logarithmic else p.off + share * away
    return replace(one, start=start)


def standing(fit: JointFit) -> tuple[ActiveTerm, ...]:
    """The effects of a fit, to start from again where it ended (places that differ: their mean)."""
    found = []
    for number, one in enumerate(fit.hypothesis.supposed):
        parameters = one.form.variant.create().parameters
        start = one.start.copy()
        for column, parameter in enumerate(parameters):
            moves = [
                x
                for x, u in zip(fit.x, fit.hypothesis.unknowns, strict=True)
                if (u.supposed, u.column) == (number, column)
            ]
            if moves:
                move = float(np.mean(moves))
                value = (
                    start[column] * np.exp(move) if parameter.logarithmic else start[column] + move
                )
                start[column] = np.clip(value, parameter.low, parameter.high)
        found.append(replace(one, start=start))
    return tuple(found)
