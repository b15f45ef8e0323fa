"""Fits of effects beside those that a fit has already: from where they start, and what they mean.

The screen tries every effect to first order at a fit. A form is a variant of an effect (its
options) and how its values may differ between joints, specimens and tests. Of its parameters,
strengths switch it on: at the value off it does nothing. Shapes say how it then acts; of them "off"
below means their default, the mean of their prior. A refit fits all unknowns anew by the full
simulator: stiffnesses of the base, parameters of the effects that stand already, and its own.
"""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects import Parameter
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.evidence import formula_error, joint_log_evidence
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, joint_fit
from spinepipe.studies.discrepancy.search.screen import ScreenedVariant

SMALLEST_START = 0.02
"""Declared prior SDs from off at which a strength starts at least. At off no reading depends on its
shapes, so that a fit could not move them.
"""

STARTS = (1.0, 0.5, 0.2)
"""Shares of the strength found on the screen at which a fit starts. The next one is tried only
where from the one before there is no fit, say because the spine has no equilibrium there.
"""


@dataclass(frozen=True)
class Refit:
    """A form beside those of the fit before, refitted with all unknowns.

    Attributes
    ----------
    fit : with the form last among its effects.
    log_evidence : of all its effects together, against the base alone; their forms' shares of each
        effect are not in it. Minus infinity where there is no fit, or it is not what its name says.
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


def refit(
    base: JointFit, beside: BaselineFit, one: ActiveTerm, instead: CandidateForm | None = None
) -> Refit:
    """One more form beside those of a fit, in the place of one of them where that is told.

    Where the spine has no stable equilibrium at the start (a load, or a joint that is too soft), or
    the fit ends off the load path, it is started again closer to off, see `STARTS`.
    """
    before = beside.fit
    for share in STARTS:
        rest = (other for other in standing(before) if other.form != instead)
        supposed = (*rest, weaker(one, share))
        fit = joint_fit(beside.suppose(supposed), beside.setting, before.poses)
        if fit.usable:
            break
    if not fit.usable or any(_degenerate(fit, number) for number in range(len(supposed))):
        return Refit(one.form, fit, -np.inf, -np.inf)
    log_evidence = joint_log_evidence(base, fit) + formula_error(beside.at(fit))
    return Refit(one.form, fit, log_evidence, before.chi2 - fit.chi2)


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
