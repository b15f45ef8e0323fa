"""Suspected mistakes in the files: they are no physics, and no effect should explain them.

Signs and units come from how joints answer their loads, without any model; scatter from repeats;
exchanged specimens from fits of the base. What cannot be told is not reported: see each part.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from spinepipe.cohort.load_response import LoadResponse, joint_loads, load_responses
from spinepipe.effects.contract import Array
from spinepipe.plausibility.score import CLEAR
from spinepipe.studies.discrepancy.mistakes.bad_markers import (
    bad_markers,
    beside_the_curve,
    between_cycles,
)
from spinepipe.studies.discrepancy.mistakes.swapped_specimens import exchanged
from spinepipe.studies.discrepancy.mistakes.wrong_units_and_signs import wrong_signs, wrong_units
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import Trials
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.search.search_state import SearchResult
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import SuspectedError
from spinepipe.units import COORDINATES


def suspected_errors(
    grounds: BaselineFit,
    measured: Sequence[SpecimenReadings],
    run: PieceRunner,
    trials: Sequence[Trials] = (),
    search: SearchResult | None = None,
) -> tuple[SuspectedError, ...]:
    """All suspected mistakes, where the base has a fit.

    Parameters
    ----------
    measured : the readings before outliers were left out; loose markers look like outliers.
    trials, search : effects that may be missing, and where the search for them ended: an exchange
        must explain the readings better.
    """
    joints = next(iter(grounds.fit.models.values())).joints
    found = [*before_a_fit(measured, joints, grounds.noise.sd, zeroed=grounds.noise.zeroed)]
    if not _is_repeated(measured):
        scatter = beside_the_curve(measured, grounds.fit.predicted)
        found += bad_markers(scatter, list(grounds.readings), joints, in_every=True)
    if not found:
        found += exchanged(grounds, run, trials, search)
    return tuple(found)


def _is_repeated(measured: Sequence[SpecimenReadings]) -> bool:
    return any(bool((test.count >= 2).any()) for one in measured for test in one.tests)


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


def answers(
    readings: Mapping[str, SpecimenReadings], zeroed: bool, sd: Array, clear: float
) -> list[LoadResponse]:
    """All driven coordinates whose motion is clear of the noise.

    Parameters
    ----------
    sd : (6,) of a reading, m and rad. clear : SDs that the motion's root mean square exceeds.
    """
    found: list[LoadResponse] = []
    for name, one in readings.items():
        for test in one.tests:
            loads = joint_loads(one.frames, test.case)
            found += load_responses(name, test.case.test, loads, test.mean, zeroed)
    return [a for a in found if a.rms > clear * sd[COORDINATES.index(a.coordinate)]]
