"""Scores of a fold: what predictions miss of readings that were left out, in noise SD."""

from collections.abc import Sequence

import numpy as np

from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.proof.chosen import Chosen, Flags, Masks
from spinepipe.discrepancy.proof.fold_linear import Placed
from spinepipe.effects.contract import Array


def scored_gap(chosen: Chosen, parts: Sequence[tuple[Masks, Placed]]) -> Gap:
    """The gap over the scored readings of all parts, noise whitened within each test."""
    white = [
        _missed(chosen, name, test, there, placed)
        for scored, placed in parts
        for name, tests in scored.items()
        for test, there in enumerate(tests)
        if there.any()
    ]
    residual = np.concatenate([np.zeros(0), *white])
    return Gap(float(residual @ residual), float(len(residual)), len(residual))


def _missed(chosen: Chosen, specimen: str, test: int, there: Flags, placed: Placed) -> Array:
    """(N,) residuals with SD one and independent where only noise is left."""
    predicted = placed.motion[specimen][test] + placed.nuisances[specimen][test]
    errors = chosen.mean(specimen, test) - predicted
    return chosen.whitening(specimen, test, there).noise_only([errors])


def pooled(gaps: Sequence[Gap]) -> Gap | None:
    """All together; None of none."""
    if not gaps:
        return None
    return Gap(
        sum(gap.chi2 for gap in gaps),
        sum(gap.dof for gap in gaps),
        sum(gap.readings for gap in gaps),
    )
