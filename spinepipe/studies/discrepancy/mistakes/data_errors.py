"""Suspected mistakes in the files: they are no physics, and no effect should explain them.

Signs and units come from how joints answer their loads, without any model; scatter from repeats;
exchanged specimens from fits of the base. What cannot be told is not reported: see each part.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.mistakes.bad_markers import bad_markers, beside_the_curve, between_cycles
from spinepipe.discrepancy.mistakes.driven import answers
from spinepipe.discrepancy.mistakes.suspected import SuspectedError
from spinepipe.discrepancy.mistakes.swapped import swapped
from spinepipe.discrepancy.mistakes.wrong_signs import wrong_signs
from spinepipe.discrepancy.mistakes.wrong_units import wrong_units
from spinepipe.discrepancy.readings import SpecimenReadings
from spinepipe.discrepancy.tasks import Run
from spinepipe.effects.contract import Array

CLEAR = 5.0
"""SDs of one reading that a joint's motion must exceed to tell a sign or a unit."""


def suspected_errors(
    grounds: Grounds, measured: Sequence[SpecimenReadings], run: Run
) -> tuple[SuspectedError, ...]:
    """All suspected mistakes, where the base has a fit.

    Parameters
    ----------
    measured : the readings before outliers were left out; loose markers look like outliers.
    """
    joints = next(iter(grounds.fit.models.values())).joints
    found = [*before_a_fit(measured, joints, grounds.noise.sd, zeroed=grounds.noise.zeroed)]
    if not _is_repeated(measured):
        scatter = beside_the_curve(measured, grounds.fit.predicted)
        found += bad_markers(scatter, list(grounds.readings), joints, in_every=True)
    if not found:
        found += swapped(grounds, run)
    return tuple(found)


def before_a_fit(
    measured: Sequence[SpecimenReadings], joints: Sequence[str], sd: Array, *, zeroed: bool
) -> tuple[SuspectedError, ...]:
    """What can be told without a model: signs, units, and scatter between cycles.

    Also when the base has no fit, which a wrong unit may well be the reason for. ``sd`` (6,) m and
    rad, NaN where nothing was read.
    """
    by_name: Mapping[str, SpecimenReadings] = {one.specimen: one for one in measured}
    found = answers(by_name, zeroed, np.nan_to_num(sd), CLEAR)
    errors = [*wrong_units(found), *wrong_signs(found, joints, list(by_name), sd)]
    if _is_repeated(measured):
        errors += bad_markers(between_cycles(measured), list(by_name), joints, in_every=False)
    return tuple(errors)


def _is_repeated(measured: Sequence[SpecimenReadings]) -> bool:
    return any(bool((test.count >= 2).any()) for one in measured for test in one.tests)
