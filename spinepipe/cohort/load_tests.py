"""Tests that nobody did: pure moments on the most cranial vertebra, in equal steps from nothing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep

__all__ = ["VIRTUAL_TESTS", "Direction", "virtual_load_cases"]


@dataclass(frozen=True)
class Direction:
    """Where a virtual test turns the most cranial vertebra.

    Attributes
    ----------
    coordinate : the coordinate of a joint that is loaded.
    axis : (x, y, z) of the moment, ground axes: x anterior, y superior, z right.
    """

    coordinate: str
    axis: tuple[float, float, float]


VIRTUAL_TESTS: Mapping[str, Direction] = {
    "flexion": Direction("extension", (0.0, 0.0, -1.0)),
    "extension": Direction("extension", (0.0, 0.0, 1.0)),
    "right_bending": Direction("right_bending", (1.0, 0.0, 0.0)),
    "left_bending": Direction("right_bending", (-1.0, 0.0, 0.0)),
    "left_rotation": Direction("left_rotation", (0.0, 1.0, 0.0)),
    "right_rotation": Direction("left_rotation", (0.0, -1.0, 0.0)),
}
"""Virtual tests by name."""


def virtual_load_cases(
    tests: Sequence[str], moment_nm: float, steps: int, body: int
) -> tuple[LoadCase, ...]:
    """Load cases of virtual tests: step 0 is unloaded, the last step carries the whole moment.

    Parameters
    ----------
    tests : names, see `VIRTUAL_TESTS`.
    moment_nm : largest moment, fixed in ground, N m.
    steps : number of equal increments.
    body : index of the loaded vertebra among the moving ones, caudal to cranial.
    """
    return tuple(
        LoadCase(test, 1, _steps(moment_nm * np.array(VIRTUAL_TESTS[test].axis), steps, body))
        for test in tests
    )


def _steps(moment: Array, steps: int, body: int) -> tuple[LoadStep, ...]:
    # a moment has no point of application
    nowhere, no_force = np.zeros(3), np.zeros(3)
    loads = [moment * number / steps for number in range(steps + 1)]
    return tuple(
        LoadStep(number, (Wrench(body, nowhere, no_force, load),))
        for number, load in enumerate(loads)
    )
