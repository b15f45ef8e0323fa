"""Motion of each reading as predicted by a fit that did not see it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.discrepancy.proof.fold_models import Predictions
from spinepipe.discrepancy.readings import SpecimenReadings
from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class HeldOutMotion:
    """A specimen's motion, per test (T, J, 6) m and rad; NaN where nothing was held out.

    Attributes
    ----------
    fold : number of the fold, -1 for none. base, with_effects : of the models alone.
    """

    fold: tuple[NDArray[np.int64], ...]
    base: tuple[Array, ...]
    with_effects: tuple[Array, ...]


def nothing_held_out(readings: Mapping[str, SpecimenReadings]) -> dict[str, HeldOutMotion]:
    """Empty sheets, to be filled by `fill`."""
    return {name: _empty(one) for name, one in readings.items()}


def _empty(one: SpecimenReadings) -> HeldOutMotion:
    shapes = [test.count.shape for test in one.tests]
    arrays = [tuple(np.full(shape, np.nan) for shape in shapes) for _ in range(2)]
    return HeldOutMotion(tuple(np.full(shape, -1) for shape in shapes), *arrays)


def fill(sheets: Mapping[str, HeldOutMotion], number: int, found: Predictions) -> None:
    """Enter a part's scored readings, where no earlier fold has."""
    for name, tests in found.scored.items():
        sheet = sheets[name]
        columns = (
            (sheet.base, found.base.motion[name]),
            (sheet.with_effects, found.with_effects.motion[name]),
        )
        for test, there in enumerate(tests):
            new = there & (sheet.fold[test] < 0)
            sheet.fold[test][new] = number
            for column, values in columns:
                column[test][new] = values[test][new]
