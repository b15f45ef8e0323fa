"""What base, model with effects and surrogate predict of a part of a fold.

Where asked for, folds are fitted anew by the full simulator, from where the full fit ended, on the
training alone. A search holds nuisances as large as their priors say, so that they never pose as
physics. A prediction of motion not seen wants them as large as they are in this cohort: the most
likely of a few sizes, given what the final model leaves (empirical Bayes).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.proof.fold_linear import (
    FoldPrediction,
    LinearFolds,
    LinearModel,
    own_unknowns,
    surrogate,
    tangent,
)
from spinepipe.studies.discrepancy.proof.folds import (
    TEST,
    ChosenSteps,
    Fold,
    FoldFit,
    Masks,
    only,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import Hypothesis, HypothesisMember
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.prediction import NoEquilibrium
from spinepipe.studies.discrepancy.search.whitening import whitening, with_nuisances
from spinepipe.studies.discrepancy.store import PieceRunner

SIZES = np.array([0.03, 0.1, 0.2, 0.35, 0.6, 1.0])
"""Of one prior SD."""


Both = tuple[FoldPrediction | str, FoldPrediction | str]
"""A part as base and model with effects have it, or why a fit has no start."""


class NoFold(RuntimeError):
    """A fold's fit has no start; the message says why."""


@dataclass(frozen=True)
class Predictions:
    """A part as predicted by each model, and which readings count.

    Attributes
    ----------
    scored : by specimen, per test (T, J, 6). surrogate : None where there is none.
    left_open : expected chi2 by nuisances that the training does not settle.
    """

    scored: Masks
    base: FoldPrediction
    with_effects: FoldPrediction
    surrogate: FoldPrediction | None
    left_open: float


class FoldModels:
    """The three models, to first order; the same model twice where no effect is named.

    Parameters
    ----------
    refit : whether base and model with effects are fitted anew by the full simulator.
    """

    def __init__(
        self,
        base: BaselineFit,
        final: BaselineFit,
        refit: bool,
        run: PieceRunner,
        with_surrogate: bool = True,
    ) -> None:
        self.grounds = (base, final)
        self.refit, self.run = refit, run
        self.named = bool(final.fit.hypothesis.supposed)
        self.chosen = ChosenSteps(base.readings, base.noise)
        size = nuisance_size(final)
        self.base = LinearFolds(tangent(base, size), self.chosen)
        self.final = LinearFolds(tangent(final, size), self.chosen) if self.named else self.base
        self.surrogate: LinearFolds | None = None
        self.why_none = ""
        if not with_surrogate:
            return
        try:
            self.surrogate = LinearFolds(surrogate(base, size), self.chosen)
        except NoEquilibrium as trouble:
            self.why_none = f"no surrogate: {trouble}"

    def predict(self, parts: Sequence[FoldFit]) -> list[Both]:
        """Each part as base and model with effects have it, before it is said what counts."""
        base = self._predict(self.grounds[0], self.base, parts)
        final = self._predict(self.grounds[1], self.final, parts) if self.named else base
        return list(zip(base, final, strict=True))

    def predictions(self, fold: Fold, part: FoldFit, both: Both) -> Predictions:
        """A part as each model has it.

        Raises
        ------
        NoFold
            When a fit by the full simulator has no start.
        """
        base, final = both
        if isinstance(base, str):
            raise NoFold(base)
        if isinstance(final, str):
            raise NoFold(final)
        by_surrogate = None if self.surrogate is None else self.surrogate.predict(part)
        scored = self._scored(fold, part)

        # trace of the nuisances' covariance after training, in noise SDs of scored readings
        covariance, left_open = self.base.left_open(part), 0.0
        for name, tests in scored.items():
            nuisances = self.base.model.members[name].nuisances
            for test, there in enumerate(tests):
                if there.any():
                    white = self.chosen.whitening(name, test, there)
                    columns = white.noise_only([nuisances[test]])
                    left_open += float(np.sum((columns @ covariance[name]) * columns))
        return Predictions(scored, base, final, by_surrogate, left_open)

    def _predict(
        self, grounds: BaselineFit, linear: LinearFolds, parts: Sequence[FoldFit]
    ) -> Sequence[FoldPrediction | str]:
        if self.refit:
            return self.run.map(refit_fold, [(grounds, linear.model, part) for part in parts])
        return [linear.predict(part) for part in parts]

    def _scored(self, fold: Fold, part: FoldFit) -> Masks:
        """Readings left out; of an unseen test those that the training determines in both models.

        A reading is determined where its prediction has a smaller standard error than itself.
        """
        left_out = self.left_out(part)
        if fold.kind != TEST:
            return left_out
        models = (self.base, self.final) if self.named else (self.base,)
        scored = left_out
        for model in models:
            errors = model.standard_errors(part)
            scored = {
                name: tuple(
                    there & (errors[name][test] < self.chosen.sd(name, test))
                    for test, there in enumerate(tests)
                )
                for name, tests in scored.items()
            }
        return scored

    def left_out(self, part: FoldFit) -> Masks:
        """By specimen, per test (T, J, 6): what was read in the load steps that are left out."""
        return {
            name: tuple(
                (self.chosen.sd(name, test) > 0.0) & steps[:, None, None]
                for test, steps in enumerate(tests)
            )
            for name, tests in part.scored.items()
        }


def refit_fold(grounds: BaselineFit, linear: LinearModel, part: FoldFit) -> FoldPrediction | str:
    """The scored specimens as fits to the training have them, or why one has no start.

    Parameters
    ----------
    linear : the grounds' fit to first order; its nuisances are used.
    """
    hypothesis = grounds.fit.hypothesis
    count = len(hypothesis.unknowns)
    free, x = np.arange(count), np.zeros(count)
    try:
        if part.apart is None:
            _, fit = _fitted(grounds, linear, part, list(hypothesis.members), free, x)
        else:
            numbers = {
                name: np.array(one.numbers, dtype=np.int64)
                for name, one in hypothesis.members.items()
            }
            own = own_unknowns(numbers, part.apart)
            others = [name for name in hypothesis.members if name != part.apart]
            # own values stay at the full fit: no training tells them yet, priors would switch
            # them off
            x, _ = _fitted(grounds, linear, part, others, np.setdiff1d(free, own), x)
            _, fit = _fitted(grounds, linear, part, [part.apart], own, x)
    except NoFold as trouble:
        return str(trouble)
    nuisances = {name: _nuisances(grounds, linear, part, name, fit) for name in part.scored}
    return FoldPrediction({name: fit.predicted[name] for name in part.scored}, nuisances)


def _fitted(
    grounds: BaselineFit,
    linear: LinearModel,
    part: FoldFit,
    specimens: Sequence[str],
    free: Indices,
    x: Array,
) -> tuple[Array, JointFit]:
    """Moves from the full fit after a fit of the free unknowns, others as in x; and that fit."""
    start = _again(grounds.fit, linear, specimens, free, x)
    readings, whitenings = {}, {}
    for name in specimens:
        one, steps = grounds.readings[name], part.training[name]
        tests = tuple(only(test, there) for test, there in zip(one.tests, steps, strict=True))
        readings[name] = replace(one, tests=tests)
        plain = whitening(tests, grounds.noise)
        whitenings[name] = with_nuisances(plain, linear.members[name].nuisances)
    fit = joint_fit(start, Setting(readings, whitenings, grounds.noise.zeroed))
    if not fit.usable:
        raise NoFold(fit.status)
    ended = x.copy()
    ended[free] += fit.x
    return ended, fit


def _again(
    fit: JointFit, linear: LinearModel, specimens: Sequence[str], free: Indices, x: Array
) -> Hypothesis:
    """The fit's hypothesis of some specimens, started where it ended, moved by x."""
    # unknowns are counted anew among the free ones; bounds and priors move with the start
    order = {int(number): place for place, number in enumerate(free)}
    members = {}
    for name in specimens:
        one = fit.hypothesis.members[name]
        kept = [k for k, number in enumerate(one.numbers) if number in order]
        members[name] = HypothesisMember(
            with_parameters(fit.models[name], one.free, x[list(one.numbers)]),
            tuple(one.free[k] for k in kept),
            tuple(order[one.numbers[k]] for k in kept),
        )
    unknowns = tuple(
        replace(
            fit.hypothesis.unknowns[number],
            low=float(linear.low[number] - x[number]),
            high=float(linear.high[number] - x[number]),
            mean=float(linear.mean[number] - x[number]),
        )
        for number in free
    )
    return Hypothesis(members, unknowns, fit.hypothesis.supposed)


def _nuisances(
    grounds: BaselineFit, linear: LinearModel, part: FoldFit, specimen: str, fit: JointFit
) -> tuple[Array, ...]:
    """What the nuisances add per test (T, J, 6), at their most likely values in the training."""
    moves = linear.members[specimen].nuisances
    pairs = zip(grounds.readings[specimen].tests, part.training[specimen], strict=True)
    tests = [only(test, there) for test, there in pairs]
    plain = whitening(tests, grounds.noise)
    left = [
        np.nan_to_num(test.mean - seen)
        for test, seen in zip(tests, fit.predicted[specimen], strict=True)
    ]
    columns, residual = plain.noise_only(moves), plain.noise_only(left)
    inner = np.eye(columns.shape[1]) + columns.T @ columns
    z = np.linalg.solve(inner, columns.T @ residual)
    return tuple(moved_by @ z for moved_by in moves)


def nuisance_size(grounds: BaselineFit) -> float:
    """Most likely size of the nuisances beside the grounds' fit, in prior SDs.

    Along each direction of the nuisances, residuals have the variance 1 of noise and that of the
    nuisance at its size; the other directions say nothing of it.
    """
    likelihood = np.zeros(len(SIZES))
    for name, one in grounds.readings.items():
        full, plain = grounds.setting.whitenings[name], grounds.plain[name]
        predicted = grounds.fit.predicted[name]
        errors = [
            np.nan_to_num(seen - test.mean) for seen, test in zip(predicted, one.tests, strict=True)
        ]
        along = full.directions.T @ plain.noise_only(errors)
        variance = 1.0 + np.outer(SIZES, full.sizes) ** 2
        likelihood -= 0.5 * np.sum(np.log(variance) + along**2 / variance, axis=1)
    return float(SIZES[np.argmax(likelihood)])
