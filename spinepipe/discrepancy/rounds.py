"""One round of a search: all effects screened at where the fit stands."""

from collections.abc import Sequence

import numpy as np

from spinepipe.discrepancy.forms import Trials
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.groups import Index
from spinepipe.discrepancy.projected import Linearised, linearised, taken_out
from spinepipe.discrepancy.screen import Screen, Screened, screen, screened
from spinepipe.discrepancy.signatures import columns_of, signatures


def look(
    grounds: Grounds, trials: Sequence[Trials], draws: int, false_alarm: float, seed: int
) -> Screen:
    """Evidence of every effect beside those of the fit, with base and nuisances taken out."""
    found = []
    for number, one in enumerate(trials):
        index, problem = linearised_for(grounds, one, draws, seed)
        found.append(screened(one, index, problem, tuple(grounds.readings), grounds.tests))
    return screen(found, false_alarm)


def linearised_for(
    grounds: Grounds, trials: Trials, draws: int, seed: int
) -> tuple[Index, Linearised]:
    """The products of one effect's signatures; draws of the null are the same for all effects."""
    fit = grounds.fit
    joints = next(iter(fit.models.values())).n_joints
    columns = columns_of(trials, joints, grounds.tests)
    white, raw = {}, {}
    for name, one in grounds.readings.items():
        moved = signatures(fit.models[name], one.cases, grounds.noise.zeroed, columns)
        plain = grounds.plain[name].noise_only(moved)
        raw[name] = np.sum(plain**2, axis=0)
        white[name] = grounds.setting.whitenings[name].shortened(plain)
    rng = np.random.default_rng(seed)
    return Index(columns), linearised(taken_out(fit), white, raw, draws, rng)


__all__ = ["Screened", "linearised_for", "look"]
