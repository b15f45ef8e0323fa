"""Readings of upright chains of springs in pure moments, by the springs' own closed form.

All joint frames are upright and above one another and nothing has weight: a moment about one axis
turns every joint about that axis alone, by what its spring yields to that moment.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from spinepipe.discrepancy.base import base_parameters
from spinepipe.discrepancy.grounds import Start
from spinepipe.discrepancy.readings import Repeats, SpecimenReadings
from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.units import ROTATIONS

Array = NDArray[np.float64]

JOINTS = ("L5S1", "L4L5", "L3L4", "L2L3", "L1L2", "T12L1")
AXES = {"flexion": (2, 3), "bending": (0, 4), "rotation": (1, 5)}
"""Ground axis of the moment, and the coordinate (of six) that it drives."""

SWEEP = (0.0, -7.5, -5.0, -2.5, 2.5, 5.0, 7.5)
THERE_AND_BACK = (0.0, 3.0, 6.0, 7.5, 6.0, 3.0, 0.0, -3.0, -6.0, -7.5, -6.0, -3.0, 0.0)
STIFFNESS = np.array([60.0, 70.0, 180.0])
"""N m/rad of `ROTATIONS`."""

SD = np.deg2rad(0.1)

Yield = Callable[[int, Array, float], Array]
"""Rotation (T,) rad of joint (index) in moments (T,) N m with stiffness N m/rad."""


def linear(joint: int, moments: Array, k: float) -> Array:
    return moments / k


def frames() -> tuple[Pose, ...]:
    return tuple(Pose(np.eye(3), np.array([0.0, 0.035 * j, 0.0])) for j in range(len(JOINTS)))


def cases(levels: Sequence[float] = SWEEP) -> list[LoadCase]:
    found = []
    for test, (axis, _) in AXES.items():
        steps = tuple(
            LoadStep(n, (Wrench(len(JOINTS) - 1, np.zeros(3), np.zeros(3), m * np.eye(3)[axis]),))
            for n, m in enumerate(levels)
        )
        found.append(LoadCase(test, 1, steps))
    return found


def readings(
    seed: int = 1,
    law: Yield = linear,
    specimens: Sequence[str] = ("a", "b", "c"),
    levels: Sequence[float] = SWEEP,
    cycles: int = 3,
    zeroed: bool = False,
    sd: float = SD,
) -> list[SpecimenReadings]:
    """Specimens of different stiffness, the same at all joints, with white noise."""
    rng = np.random.default_rng(seed)
    found = []
    for name in specimens:
        stiffness = STIFFNESS * np.exp(rng.normal(0.0, 0.3, 3))
        tests = []
        for case in cases(levels):
            q = np.zeros((len(levels), len(JOINTS), 6))
            driven = AXES[case.test][1]
            for joint in range(len(JOINTS)):
                q[:, joint, driven] = law(joint, np.array(levels), stiffness[driven - 3])
            seen = q + sd * rng.standard_normal((cycles, *q.shape))
            if zeroed:
                seen = seen - seen[:, :1]
                seen[:, 0] = np.nan
            seen[..., :3] = np.nan
            tests.append(Repeats(case, seen))
        found.append(SpecimenReadings(name, frames(), tuple(tests)))
    return found


def changed(
    given: Sequence[SpecimenReadings], change: Callable[[str, str, Array], Array]
) -> list[SpecimenReadings]:
    """The readings with ``change(specimen, test, cycles)``."""
    return [
        SpecimenReadings(
            one.specimen,
            one.frames,
            tuple(Repeats(t.case, change(one.specimen, t.case.test, t.cycles)) for t in one.tests),
        )
        for one in given
    ]


def model(specimen: str, stiffness: Array) -> SpineModel:
    """A weightless upright chain with linear bushings."""
    bodies = tuple(
        Body(name, 1e-6, pose.origin, 1e-9 * np.eye(3))
        for name, pose in zip(JOINTS, frames(), strict=True)
    )
    values = np.tile([1e5, 1e6, 1e5, *stiffness], (len(JOINTS), 1))
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(len(JOINTS))), values)
    damping = np.ones((len(JOINTS), 6))
    return SpineModel(specimen, JOINTS, frames(), bodies, np.zeros(3), damping, (bushing,))


def start(given: Sequence[SpecimenReadings], grouping: str = "per_specimen") -> Start:
    """Where fits of the readings start: the same stiffness everywhere."""
    models: Mapping[str, SpineModel] = {r.specimen: model(r.specimen, STIFFNESS) for r in given}
    base = {name: base_parameters(m, grouping, ROTATIONS) for name, m in models.items()}
    return Start(models, base, 100.0)
