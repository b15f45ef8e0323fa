"""Which other effects could have made the same readings, since nothing that tells was recorded.

An effect that needs what the files do not have cannot be fitted, so the evidence never speaks for
it, and not against it either. That is no reason to call another one by its name:

- A loop of loading and unloading is friction (hysteresis) or, had time passed, creep. So is a zero
  that has moved on at the end of a test. Only recorded times tell.
- Joints that differ in stiffness differ by level or, where all tests compress them alike, by how
  much each is compressed. Only a second compression tells.
"""

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase

SAME = 0.05
"""Share of the largest listed force by which tests that compress alike may differ."""

Cases = Mapping[str, Sequence[LoadCase]]
"""Load histories by specimen."""


def cannot_be_excluded(name: str, cases_by_specimen: Cases) -> tuple[str, ...]:
    """Effects that these tests cannot tell from the named one, whatever was read in them.

    Parameters
    ----------
    name : of an effect that would be named. cases_by_specimen : the tests as they were recorded.
    """
    found = {
        "hysteresis": ("creep",) if not records_time(cases_by_specimen) else (),
        "neutral_pose_drift": ("creep",) if not records_time(cases_by_specimen) else (),
        "level_dependence": ("preload_stiffening",) if one_preload(cases_by_specimen) else (),
        "preload_stiffening": () if several_preloads(cases_by_specimen) else ("level_dependence",),
    }
    return found.get(name, ())


def records_time(cases_by_specimen: Cases) -> bool:
    """Whether time passes in every test that has more than one load step."""
    several = [case for case in _every(cases_by_specimen) if len(case.steps) > 1]
    return bool(several) and all(map(_takes_time, several))


def one_preload(cases_by_specimen: Cases) -> bool:
    """Whether a force acts in every step, and is the same in all tests."""
    smallest, largest = _forces_that_stay(cases_by_specimen)
    return largest > 0.0 and largest - smallest <= SAME * largest


def several_preloads(cases_by_specimen: Cases) -> bool:
    """Whether tests differ in the forces that act in all of their steps, or forces change."""
    smallest, largest = _forces_that_stay(cases_by_specimen)
    return largest - smallest > SAME * largest or _forces_change(cases_by_specimen)


def _every(cases_by_specimen: Cases) -> list[LoadCase]:
    return list(chain.from_iterable(cases_by_specimen.values()))


def _takes_time(case: LoadCase) -> bool:
    times = [step.time for step in case.steps if step.time is not None]
    return len(times) == len(case.steps) and times[-1] > times[0]


def _forces_that_stay(cases_by_specimen: Cases) -> tuple[float, float]:
    """N: of the tests, the smallest and largest force that acts in all steps of one."""
    stay = [float(_sizes(case).min()) for case in _every(cases_by_specimen)]
    return min(stay, default=0.0), max(stay, default=0.0)


def _forces_change(cases_by_specimen: Cases) -> bool:
    for case in _every(cases_by_specimen):
        sizes = _sizes(case)
        if sizes.max() - sizes.min() > SAME * sizes.max():
            return True
    return False


def _sizes(case: LoadCase) -> Array:
    """(T,) N, all listed forces of each step by their sizes."""
    return np.array(
        [sum(float(np.linalg.norm(w.force)) for w in step.wrenches) for step in case.steps]
    )
