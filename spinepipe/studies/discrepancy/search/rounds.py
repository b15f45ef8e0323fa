"""One round of a search: all effects screened at where the fit stands."""

from collections.abc import Sequence

import numpy as np

from spinepipe.discrepancy.forms import Trials
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.groups import Index
from spinepipe.discrepancy.prediction import Solved
from spinepipe.discrepancy.projected import (
    Linearised,
    Products,
    drawn,
    linearised,
    products,
    taken_out,
)
from spinepipe.discrepancy.screen import Screen, screen, screened
from spinepipe.discrepancy.signatures import columns_of, signatures


def look(
    grounds: Grounds,
    trials: Sequence[Trials],
    draws: int,
    false_alarm: float,
    seed: int,
    threshold: float | None = None,
) -> Screen:
    """Evidence of every effect beside those of the fit, with base and nuisances taken out.

    Parameters
    ----------
    threshold : as known already; then no draws of the null are needed.
    """
    number = draws if threshold is None else 0
    problems = linearised_for(grounds, trials, number, seed)
    found = [
        screened(one, index, problem, tuple(grounds.readings), grounds.tests)
        for one, (index, problem) in zip(trials, problems, strict=True)
    ]
    return screen(found, false_alarm, threshold)


def linearised_for(
    grounds: Grounds, trials: Sequence[Trials], draws: int, seed: int
) -> list[tuple[Index, Linearised]]:
    """The products of each effect's signatures; draws of the null are the same for all effects."""
    joints = next(iter(grounds.fit.models.values())).n_joints
    columns = [columns_of(one, joints, grounds.tests) for one in trials]
    taken = taken_out(grounds.fit)
    parts: list[dict[str, Products]] = [{} for _ in trials]
    for number, (name, one) in enumerate(grounds.readings.items()):
        solved = Solved(grounds.fit.models[name], one.cases, grounds.noise.zeroed)
        errors = drawn(taken[name], draws, np.random.default_rng([seed, number]))
        for place, of_effect in zip(parts, columns, strict=True):
            plain = grounds.plain[name].noise_only(signatures(solved, of_effect))
            white = grounds.setting.whitenings[name].shortened(plain)
            place[name] = products(taken[name], white, np.sum(plain**2, axis=0), errors)
    return [
        (Index(of_effect), linearised(place))
        for of_effect, place in zip(columns, parts, strict=True)
    ]
