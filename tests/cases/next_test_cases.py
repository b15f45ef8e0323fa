"""A joint law of closed form, its readings, and one more run of a test to see what it tells."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import spring_chain_cases as chains
from numpy.typing import NDArray
from search_cases import exponential

from spinepipe.effects import PlaceSpread
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.design.plans import summed_loads
from spinepipe.studies.discrepancy.search.baseline import BaselineFit, fit_baseline
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Trials,
    trials,
)
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.refit import Refit, refit
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.units import ROTATIONS

Array = NDArray[np.float64]

JOINTS = 3
STIFFNESS = {"a": np.array([55.0, 70.0, 170.0]), "b": np.array([65.0, 75.0, 190.0])}
UP = (0.0, 2.5, 5.0, 7.5)
RATE = 3.0
"""1/rad, of stiffening in the test called flexion, which turns joints about z alone."""

NOISE = Noise(
    np.r_[[np.nan] * 3, [chains.SD] * 3], 0.0, "repeats", np.zeros(6, dtype=np.int64), 0, False
)


def cycles(specimen: str, case: LoadCase, count: int, seed: int) -> Repeats:
    """Readings of rotations in a case of pure moments, by the law's own inverse."""
    rng = np.random.default_rng([seed, ord(specimen)])
    moments = 10.0 * np.array(summed_loads(case))[:, 3:]
    q = np.zeros((len(case.steps), JOINTS, 6))
    for axis, driven in chains.AXES.values():
        k = STIFFNESS[specimen][driven - 3]
        stiffens = axis == 2
        law = exponential(RATE) if stiffens else chains.linear
        for joint in range(JOINTS):
            q[:, joint, driven] = law(joint, moments[:, axis], k)
    seen = q + chains.SD * rng.standard_normal((count, *q.shape))
    seen[..., :3] = np.nan
    return Repeats(case, seen)


def readings(seed: int, added: Sequence[LoadCase] = (), added_seed: int = 0):
    """Two specimens, three tests, three cycles each, and one cycle of each added run."""
    return [
        SpecimenReadings(
            name,
            chains.frames(JOINTS),
            (
                *(cycles(name, case, 3, seed) for case in chains.cases(UP, JOINTS)),
                *(cycles(name, case, 1, 1000 + added_seed) for case in added),
            ),
        )
        for name in STIFFNESS
    ]


def grounds_of(
    given: Sequence[SpecimenReadings], priors: NuisancePriors | None = None
) -> BaselineFit:
    """The base fitted, noise as it is."""
    return fit_baseline(given, NOISE, priors or NuisancePriors(), chains.start(given), at_once)


def tried(effects: Sequence[str]) -> Mapping[str, Trials]:
    """All that is tried of some effects."""
    return {one.effect: one for one in trials(effects, ROTATIONS, tuple(STIFFNESS), JOINTS)}


def shared_form(trials: Trials, **options: str) -> CandidateForm:
    """The form with these options whose values are the same everywhere."""
    return next(
        form
        for form in trials.forms
        if form.spread is PlaceSpread.SHARED
        and options.items() <= dict(form.variant.options).items()
    )


def fitted(grounds: BaselineFit, form: CandidateForm) -> Refit:
    """The form beside the base, from a third of its typical strength."""
    start = []
    for p in form.variant.create().parameters:
        if p.off is None:
            start.append(p.default)
        elif p.logarithmic:
            start.append(p.off * (p.default / p.off) ** 0.3)
        else:
            start.append(p.off + 0.3 * (p.default - p.off))
    return refit(grounds.fit, grounds, ActiveTerm(form, np.array(start)))


def scaled_case(test: str, factor: float) -> LoadCase:
    """A test with all its moments times a factor."""
    levels = [factor * level for level in UP]
    (case,) = [one for one in chains.cases(levels, JOINTS) if one.test == test]
    return replace(case)
