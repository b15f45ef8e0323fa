"""What a load case mainly does, and virtual tests that nobody did.

Mainly: its largest moment, and which joint coordinate that drives. Virtual: pure moments on the
most cranial vertebra, in equal steps from nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep
from spinepipe.units import COORDINATES

DRIVEN = ("right_bending", "left_rotation", "extension")
"""Coordinate driven by a moment about x, y and z of ground."""

PUSHED = ("anterior", "superior", "right")
"""Coordinate driven by a force along x, y and z of ground."""


def moments(case: LoadCase) -> Array:
    """(T, 3) N m, ground: sum of the moments of each load step."""
    return _sums([[wrench.moment for wrench in step.wrenches] for step in case.steps])


def forces(case: LoadCase) -> Array:
    """(T, 3) N, ground: sum of the forces of each load step."""
    return _sums([[wrench.force for wrench in step.wrenches] for step in case.steps])


def _sums(vectors: Sequence[Sequence[Array]]) -> Array:
    """(T, 3) sum of the vectors of each load step; zero where there are none."""
    return np.array([np.sum([np.zeros(3), *of_step], axis=0) for of_step in vectors])


def peak_step(case: LoadCase) -> int:
    """Place of the load step with the largest moment; the first of equal ones.

    Where no moment is applied, the step with the largest force.
    """
    applied = moments(case)
    if not applied.any():
        applied = forces(case)
    return int(np.argmax(np.linalg.norm(applied, axis=1)))


def loaded_coordinate(case: LoadCase) -> str | None:
    """The coordinate that the largest moment drives; None where no moment is applied."""
    largest = moments(case)[peak_step(case)]
    if not largest.any():
        return None
    coordinate = DRIVEN[int(np.argmax(np.abs(largest)))]
    assert coordinate in COORDINATES
    return coordinate


def pushed_coordinate(case: LoadCase) -> str | None:
    """The coordinate that the largest force drives; None where no force is applied."""
    largest = forces(case)[most_pushed_step(case)]
    return PUSHED[int(np.argmax(np.abs(largest)))] if largest.any() else None


def most_pushed_step(case: LoadCase) -> int:
    """Place of the load step with the largest force; the first of equal ones."""
    return int(np.argmax(np.linalg.norm(forces(case), axis=1)))


def coupled_range(case: LoadCase) -> float:
    """N m: root sum square of the ranges of the two moments beside the main one."""
    applied = moments(case)
    main = int(np.argmax(np.abs(applied[peak_step(case)])))
    ranges = np.delete(np.ptp(applied, axis=0), main)
    return float(np.linalg.norm(ranges))


@dataclass(frozen=True)
class TurnDirection:
    """Where a virtual test turns the most cranial vertebra.

    Attributes
    ----------
    coordinate : the coordinate of a joint that is loaded.
    axis : (x, y, z) of the moment, ground axes: x anterior, y superior, z right.
    """

    coordinate: str
    axis: tuple[float, float, float]


VIRTUAL_TESTS: Mapping[str, TurnDirection] = {
    "flexion": TurnDirection("extension", (0.0, 0.0, -1.0)),
    "extension": TurnDirection("extension", (0.0, 0.0, 1.0)),
    "right_bending": TurnDirection("right_bending", (1.0, 0.0, 0.0)),
    "left_bending": TurnDirection("right_bending", (-1.0, 0.0, 0.0)),
    "left_rotation": TurnDirection("left_rotation", (0.0, 1.0, 0.0)),
    "right_rotation": TurnDirection("left_rotation", (0.0, -1.0, 0.0)),
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
