"""Effects withheld because they are no larger than the imperfections allowed for.

Such an effect would be evident were the imperfections known exactly, and is not as they are. Its
evidence is asked again with the prior SD of one kind of imperfection at a time made smaller; the
largest at which it would be evident is what that kind would have to be known to.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials
from spinepipe.studies.discrepancy.search.imperfections import labels_of
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    columns_of,
    linearised,
    products,
    signatures,
    taken_out,
)
from spinepipe.studies.discrepancy.search.screen import EffectColumns, Screened, summed
from spinepipe.studies.discrepancy.search.search_state import look
from spinepipe.studies.discrepancy.search.whitening import rescaled
from spinepipe.studies.discrepancy.store import PieceRunner

FACTORS = (0.5, 0.25, 0.0)
"""Of a prior SD, at which evidence is told."""

MOST_WITHHELD = 3
"""Effects that are looked at, those with the most evidence without imperfections."""

REAL_SHARE = 0.3
"""Of the largest evidence without imperfections that another effect must have to be looked at.

What one imperfection makes many effects imitate a little.
"""

AS_GOOD_AS_KNOWN = 0.02
"""Share of a prior SD below which nobody can know it: then it is said to be out of reach."""


@dataclass(frozen=True)
class MaskedEffects:
    """An effect, and one kind of imperfection that hides it.

    Attributes
    ----------
    form, sds : of the effect, as it shows best. kind : of the imperfection; prior : its SD now, in
        ``unit``, SI. now, at : log evidence as things are, and by factor of the prior SD.
    needed : factor at which it would reach the threshold; None where it does not or hardly could.
    """

    effect: str
    form: CandidateForm
    sds: tuple[float, ...]
    kind: str
    prior: float
    unit: str
    now: float
    at: Mapping[float, float]
    needed: float | None


def masked_effects(
    grounds: BaselineFit,
    trials: Sequence[Trials],
    threshold: float,
    named: Sequence[str],
    run: PieceRunner,
) -> tuple[MaskedEffects, ...]:
    """Effects beside those of the grounds' fit that imperfections hide.

    Parameters
    ----------
    threshold : log evidence that is needed. named : effects that the verdict stands for already.
    """
    kinds = kinds_of(grounds)
    if not kinds:
        return ()
    without = run(look, with_narrower_priors(grounds, dict.fromkeys(kinds, 0.0)), trials)
    by_name = {one.effect: one for one in trials}
    most = without.effects[0].log_evidence
    return tuple(
        found
        for one in without.effects
        if one.effect not in named and one.log_evidence > max(threshold, REAL_SHARE * most)
        for found in _hidden(grounds, by_name[one.effect], one, kinds, threshold)
    )[: MOST_WITHHELD * len(kinds)]


def _hidden(
    grounds: BaselineFit,
    trials: Trials,
    one: Screened,
    kinds: Mapping[str, tuple[float, str]],
    threshold: float,
) -> list[MaskedEffects]:
    """Each kind of imperfection that hides an effect by itself, or the one that comes nearest."""
    best = one.forms[0]
    evidence = MaskedEvidence(grounds, trials, best.form, best.sds)
    now = evidence.under(grounds)
    if now > threshold:
        return []  # it is evident: whatever keeps it from a name is something else
    found = []
    for kind, (prior, unit) in kinds.items():

        def at(factor: float, kind: str = kind) -> float:
            return evidence.under(with_narrower_priors(grounds, {kind: factor}))

        told = {factor: at(factor) for factor in FACTORS}
        needed = None
        if told[0.0] > threshold:
            # evidence falls with the prior SD: above the threshold at 0, below at 1 (Brent)
            root = float(brentq(lambda f, at=at: at(f) - threshold, 0.0, 1.0, xtol=5e-3))
            needed = root if root > AS_GOOD_AS_KNOWN else None
        found.append(
            MaskedEffects(trials.effect, best.form, best.sds, kind, prior, unit, now, told, needed)
        )
    reaching = [w for w in found if w.at[0.0] > threshold]
    return reaching or [max(found, key=lambda w: w.at[0.0])]


def kinds_of(grounds: BaselineFit) -> dict[str, tuple[float, str]]:
    """Kinds of imperfections that are allowed for, with prior SD and unit."""
    labels = labels_of(grounds, next(iter(grounds.readings)))
    return {one.kind: (one.sd, one.unit) for one in labels}


def with_narrower_priors(grounds: BaselineFit, factors: Mapping[str, float]) -> BaselineFit:
    """The grounds with prior SDs of some kinds of imperfections times a factor; the fit stays."""
    whitenings, residuals, jacobians = {}, {}, {}
    for name, white in grounds.setting.whitenings.items():
        by_column = np.array([factors.get(one.kind, 1.0) for one in labels_of(grounds, name)])
        narrow = rescaled(white, by_column)
        # residuals are whitened by the old covariance: back to noise SD, then by the new one
        whitenings[name] = narrow
        residuals[name] = narrow.shortened(white.lengthened(grounds.fit.residuals[name]))
        jacobians[name] = narrow.shortened(white.lengthened(grounds.fit.jacobians[name]))
    setting = replace(grounds.setting, whitenings=whitenings)
    fit = replace(grounds.fit, residuals=residuals, jacobians=jacobians)
    return replace(grounds, setting=setting, fit=fit)


class MaskedEvidence:
    """Log evidence of one form at one shape on the linear screen, its share taken off."""

    def __init__(
        self, grounds: BaselineFit, trials: Trials, form: CandidateForm, sds: tuple[float, ...]
    ) -> None:
        """The form's signatures where the grounds' fit stands."""
        alone = Trials(trials.effect, (form.variant,), (form,))
        joints = next(iter(grounds.fit.models.values())).n_joints
        columns = columns_of(alone, joints, grounds.tests)
        self._index, self._form, self._sds = EffectColumns(columns), form, sds
        self._share = trials.log_share(form)
        self._moved = {
            name: grounds.plain[name].noise_only(
                signatures(
                    SolvedSpecimen(grounds.fit.models[name], one.cases, grounds.noise.zeroed),
                    columns,
                )
            )
            for name, one in grounds.readings.items()
        }

    def under(self, grounds: BaselineFit) -> float:
        """With imperfections as the grounds allow for them."""
        taken = taken_out(grounds.fit)
        parts = {
            name: products(
                taken[name],
                grounds.setting.whitenings[name].shortened(moved),
                np.sum(moved**2, axis=0),
            )
            for name, moved in self._moved.items()
        }
        specimens = tuple(grounds.readings)
        problem = linearised(parts)
        one = summed(self._index, problem, self._form, self._sds, specimens, grounds.tests)
        return float(one.group.log_evidence(one.moments)) + self._share
