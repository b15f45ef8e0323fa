"""Nonlinear refits of the forms that lead the screen, with their evidence by Laplace's method.

The screen tries every effect to first order at the baseline's fit. A form is a variant of an effect
(its options) and how its values may differ between joints, specimens and tests. Of its parameters,
strengths switch it on: at the value off it does nothing. Shapes say how it then acts; of them "off"
below means their default, the mean of their prior. A refit adds one form to those of the baseline's
fit and fits all unknowns anew by the full simulator: stiffnesses of the base, parameters of the
effects that stand already, and its own.

All evidence is the natural logarithm of a ratio of marginal likelihoods (Bayes factor), all chi2 is
of whitened residuals: imperfections of the set-up are in the noise.
"""

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
"""Declared prior SDs from off at which a strength starts at least. At off no reading depends on its
shapes, so that a fit could not move them.
"""

STARTS = (1.0, 0.5, 0.2)
"""Shares of the strength found on the screen at which a fit starts. The next one is tried only
where from the one before there is no fit, say because the spine has no equilibrium there.
"""

MOST_EFFECTS, MOST_FORMS = 4, (3, 3, 1, 1)
"""How many effects from the top of the screen are refitted, and of each, by its place, how many
variants. A form with equal values may come besides, see `_forms`.
"""

ANOTHER_FORM = 3.0
"""Log evidence by which a form with more unknowns must be better than a plainer one of the same
effect: odds of 20 to 1, from which on evidence is called strong (Kass and Raftery 1995).
"""

SCREEN_SHARE, SCREEN_MARGIN = 0.75, 6.0
"""How far an effect may be behind the leader of the screen and still be refitted: by this share of
the leader's log evidence and by this many units besides, see `_least`. Much, as the screen is
linear and a strong effect is not.
"""


@dataclass(frozen=True)
class Refit:
    """A form beside those of the fit before, refitted with all unknowns.

    Attributes
    ----------
    fit : with the form last among its effects.
    log_evidence : for the form, against the fit before. The logarithm of the form's share of its
        effect (below 0, see `Trials.log_share`) is added, so that an effect gains nothing by having
        many forms. Minus infinity where there is no fit, or it is not what its name says.
    gain : chi2 of the fit before less that of this one.
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
        """How many numbers the form adds to what is fitted."""
        unknowns = self.fit.hypothesis.unknowns
        return sum(one.supposed == len(self.fit.hypothesis.supposed) - 1 for one in unknowns)


def refits(
    baseline: BaselineFit,
    screen: Screen,
    trials: Sequence[Trials],
    run: PieceRunner,
    progress: Progress,
) -> tuple[Refit, ...]:
    """The leading forms of a screen, each refitted beside the baseline's fit, in the order of
    `rank_refits`.

    Variants that stand in the baseline's fit already are not added again. After the first refits,
    the leading ones are tried once more with equal values everywhere, see `_simpler`.

    Parameters
    ----------
    trials : of all effects, for the shares of their forms.
    """
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
    """Refits by log evidence, best first, but of each effect a plain form first, if one is near.

    Of the forms of one effect whose log evidence is less than `ANOTHER_FORM` behind the best, that
    with the fewest unknowns takes the best one's place. A form with values of its own for each
    specimen says little of a specimen that was not measured: unless the data clearly ask for it,
    equal values predict better.
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
    """The best forms of two effects again, with values the same everywhere, where not tried yet.

    They start from the values that the refit ended at (of places that differ, their mean).

    Parameters
    ----------
    before : effects of the fit before; that of the refit stands behind them.
    """
    ranked = sorted(found, key=lambda one: -one.log_evidence)
    # each effect with its best refit; effects stand in the order of the worst refit of each
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

    Laplace's method (Kass and Raftery 1995, doi 10.2307/2291091): the likelihood of the effect's
    parameters is taken for normal about the fit, which is a distance a from off, with the curvature
    A of chi2 / 2. With the prior N(off, S) the log evidence is

        gain / 2 - log det(I + A S) / 2 - a' (A^-1 + S)^-1 a / 2

    S is diagonal. A strength has t times its declared prior SD, and the evidence (not its
    logarithm) is averaged over the sizes t of the screen; a shape has its declared prior SD.
    Strengths of which bounds allow one side of off alone have half a normal as prior, which adds
    log 2 + log Phi(mean / sd) for each, with mean and SD of its posterior: see `Group`.

    Parameters
    ----------
    number : of the effect among those supposed by the fit.
    gain : chi2 without the effect less that of the fit.
    """
    unknowns = fit.hypothesis.unknowns
    own = np.array([u.supposed == number for u in unknowns])
    curvature = curvature_of(fit, own)
    chosen = [u for u in unknowns if u.supposed == number]
    away = fit.x[own] - np.array([u.mean for u in chosen])  # a: off is the mean of the prior
    is_strength = np.array([u.is_strength for u in chosen])
    # the fit itself has a wider prior on strengths, by STRENGTH_SDS
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
    """Drop of chi2 by one effect of a fit, and its log evidence, by the curvature at the fit alone.

    For an effect without which the others have no fit, so that there is no chi2 to compare with: it
    is taken as if chi2 were a parabola from the fit back to off, all other unknowns fitted anew.
    The form's share of its effect is not in this log evidence.
    """
    own = np.array([u.supposed == number for u in fit.hypothesis.unknowns])
    off = np.array([u.mean for u in fit.hypothesis.unknowns])
    away = (fit.x - off)[own]
    gain = float(away @ curvature_of(fit, own) @ away)
    return gain, laplace(fit, number, gain)


def curvature_of(fit: JointFit, own: NDArray[np.bool_]) -> Array:
    """(k, k) second derivative of chi2 / 2 by k of the unknowns, where all others follow by a fit.

    The others have their weak priors, the k have none: their prior comes in with the evidence.

    Parameters
    ----------
    own : (m,) which of all unknowns.
    """
    # the Schur complement of J'J + P in the others, with P = diag(1 / sd^2) of their priors: F'F of
    # the k columns of J less their projection on the others' [J; P^(1/2)], by QR
    jacobian = fit.whole_jacobian()
    priors = np.diag([1.0 / u.sd for u in fit.hypothesis.unknowns])
    others = np.vstack([jacobian[:, ~own], priors[np.ix_(~own, ~own)]])
    mine = np.vstack([jacobian[:, own], np.zeros((int((~own).sum()), int(own.sum())))])
    basis, _ = np.linalg.qr(others)
    left = mine - basis @ (basis.T @ mine)
    result: Array = left.T @ left
    return result


def leading(screen: Screen) -> Iterator[ScreenedVariant]:
    """Forms worth a refit: of the first effects of the screen, while their log evidence is above
    `_least`.
    """
    least = _least(screen.effects[0].log_evidence)
    for place, one in enumerate(screen.effects[:MOST_EFFECTS]):
        if one.log_evidence > least:
            yield from _forms(one, MOST_FORMS[place])


def _least(best: float) -> float:
    """Log evidence on the screen above which a refit may still win; ``best`` : the leader's."""
    return max(0.0, best - SCREEN_MARGIN - SCREEN_SHARE * best)


def _forms(one: Screened, most: int) -> list[ScreenedVariant]:
    """Of one effect the best form of each of its best variants, so many variants at most.

    Besides, of the best variant, the form with the same values everywhere, if it is another one and
    not far behind.

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
    """The form with the shapes, and the strengths, at which it does best on the screen.

    A start has one value for all places: of strengths that differ between places the mean.
    """
    variant = tried.form.variant
    parameters = variant.create().parameters
    values = variant.off(tried.sds)
    for column in variant.strengths:
        of_column = [e for e, c in zip(tried.estimate, tried.strengths, strict=True) if c == column]
        values[column] = _value(parameters[column], float(np.mean(of_column)))
    return ActiveTerm(tried.form, values)


def _value(p: Parameter, sds: float) -> float:
    """A strength that many declared prior SDs from off, at least `SMALLEST_START`.

    On the side of off that the bounds allow, and strictly between the bounds, as a descent needs.
    """
    assert p.off is not None
    side = p.side or float(np.sign(sds) or 1.0)
    away = side * max(abs(sds), SMALLEST_START) * p.prior_scale
    value = p.off * np.exp(away) if p.logarithmic else p.off + away
    margin = min(1e-3 * (p.high - p.low), SMALLEST_START * p.prior_scale)
    return float(np.clip(value, p.low if p.logarithmic else p.low + margin, p.high - margin))


def refit(baseline: BaselineFit, one: ActiveTerm, trials: Trials) -> Refit:
    """One more form beside those of the baseline's fit.

    Where the spine has no stable equilibrium at the start (a load, or a joint that is too soft), or
    the fit ends off the load path, it is started again closer to off, see `STARTS`.
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
    """The same term with its strengths started nearer to off: at that share of the way, in the
    logarithm where fits work with it. Shapes stay.
    """
    parameters, start = one.form.variant.create().parameters, one.start.copy()
    for column in one.form.variant.strengths:
        p = parameters[column]
        assert p.off is not None
        away = start[column] / p.off if p.logarithmic else start[column] - p.off
        start[column] = p.off * away**share if p.logarithmic else p.off + share * away
    return replace(one, start=start)


def standing(fit: JointFit) -> tuple[ActiveTerm, ...]:
    """The effects of a fit, to start from again where it ended.

    A start has one value for all places: of those that differ between places the mean move from the
    old start, so of logarithmic parameters the geometric mean.
    """
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
