"""What base, model with effects and surrogate predict of a part of a fold."""

from dataclasses import dataclass

import numpy as np

from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.prediction import NoEquilibrium
from spinepipe.discrepancy.proof.chosen import Chosen, Flags, Masks
from spinepipe.discrepancy.proof.fold_linear import LinearFolds, Placed
from spinepipe.discrepancy.proof.fold_refit import refitted
from spinepipe.discrepancy.proof.folds import TEST, Fold, Part
from spinepipe.discrepancy.proof.nuisance_size import nuisance_size
from spinepipe.discrepancy.proof.surrogate import surrogate
from spinepipe.discrepancy.proof.tangent import tangent
from spinepipe.discrepancy.tasks import Run
from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class Predictions:
    """A part as predicted by each model, and which readings count.

    Attributes
    ----------
    scored : by specimen, per test (T, J, 6). surrogate : None where there is none.
    left_open : expected chi2 by nuisances that the training does not settle.
    """

    scored: Masks
    base: Placed
    with_effects: Placed
    surrogate: Placed | None
    left_open: float


class FoldModels:
    """The three models, to first order; the same model twice where no effect is named.

    Parameters
    ----------
    refit : whether base and model with effects are fitted anew by the full simulator.
    """

    def __init__(self, base: Grounds, final: Grounds, refit: bool, run: Run) -> None:
        self.grounds = (base, final)
        self.refit, self.run = refit, run
        self.named = bool(final.fit.hypothesis.supposed)
        self.chosen = Chosen(base.readings, base.noise)
        size = nuisance_size(final)
        self.base = LinearFolds(tangent(base, size), self.chosen)
        self.final = LinearFolds(tangent(final, size), self.chosen) if self.named else self.base
        self.surrogate, self.why_none = self._surrogate(size)

    def _surrogate(self, size: float) -> tuple[LinearFolds | None, str]:
        try:
            return LinearFolds(surrogate(self.grounds[0], size), self.chosen), ""
        except NoEquilibrium as trouble:
            return None, f"no surrogate: {trouble}"

    def predictions(self, fold: Fold, part: Part) -> Predictions:
        """A part as each model has it.

        Raises
        ------
        NoFold
            When a fit by the full simulator has no start.
        """
        base = self._placed(self.grounds[0], self.base, part)
        final = self._placed(self.grounds[1], self.final, part) if self.named else base
        by_surrogate = None if self.surrogate is None else self.surrogate.placed(part)
        scored = self._scored(fold, part)
        return Predictions(scored, base, final, by_surrogate, self._left_open(part, scored))

    def _left_open(self, part: Part, scored: Masks) -> float:
        """Trace of the nuisances' covariance after training, in noise SDs of scored readings."""
        covariance, total = self.base.left_open(part), 0.0
        for name, tests in scored.items():
            nuisances = self.base.model.members[name].nuisances
            for test, there in enumerate(tests):
                if there.any():
                    white = self.chosen.whitening(name, test, there)
                    columns = white.noise_only([nuisances[test]])
                    total += float(np.sum((columns @ covariance[name]) * columns))
        return total

    def _placed(self, grounds: Grounds, linear: LinearFolds, part: Part) -> Placed:
        if self.refit:
            return refitted(grounds, linear.model, part, self.run)
        return linear.placed(part)

    def _scored(self, fold: Fold, part: Part) -> Masks:
        """Readings left out; of an unseen test those that the training determines in both models.

        A reading is determined where its prediction has a smaller standard error than itself.
        """
        left_out = self.left_out(part)
        if fold.kind != TEST:
            return left_out
        models = (self.base, self.final) if self.named else (self.base,)
        errors = [model.standard_errors(part) for model in models]
        return {
            name: tuple(
                there & self._told(name, test, [error[name][test] for error in errors])
                for test, there in enumerate(tests)
            )
            for name, tests in left_out.items()
        }

    def _told(self, specimen: str, test: int, errors: list[Array]) -> Flags:
        sd = self.chosen.sd(specimen, test)
        told: Flags = sd > 0.0
        for error in errors:
            told = told & (error < sd)
        return told

    def left_out(self, part: Part) -> Masks:
        """By specimen, per test (T, J, 6): what was read in the load steps that are left out."""
        return {
            name: tuple(
                (self.chosen.sd(name, test) > 0.0) & steps[:, None, None]
                for test, steps in enumerate(tests)
            )
            for name, tests in part.scored.items()
        }
