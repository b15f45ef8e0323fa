"""Readings of upright chains of springs in pure moments, by the springs' own closed form.

All joint frames are upright and above one another and nothing has weight: a moment about one axis
turns every joint about that axis alone, by what its spring yields to that moment.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.studies.discrepancy.search.baseline import BaselineModels, base_parameters
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
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


def frames(joints: int = len(JOINTS)) -> tuple[Pose, ...]:
    return tuple(Pose(np.eye(3), np.array([0.0, 0.035 * j, 0.0])) for j in range(joints))


def cases(levels: Sequence[float] = SWEEP, joints: int = len(JOINTS)) -> list[LoadCase]:
    found = []
    for test, (axis, _) in AXES.items():
        steps = tuple(
            LoadStep(n, (Wrench(joints - 1, np.zeros(3), np.zeros(3), m * np.eye(3)[axis]),))
            for n, m in enumerate(levels)
        )
        found.append(LoadCase(test, 1, steps))
    return found


def readings(
    seed: int = 1,
    law: Yield | Mapping[str, Yield] = linear,
    specimens: Sequence[str] = ("a", "b", "c"),
    levels: Sequence[float] = SWEEP,
    cycles: int = 3,
    zeroed: bool = False,
    sd: float = SD,
    joints: int = len(JOINTS),
) -> list[SpecimenReadings]:
    """Specimens of different stiffness, the same at all joints, with white noise.

    Parameters
    ----------
    law : what joints yield, or by test; linear in tests that are not named.
    """
    rng = np.random.default_rng(seed)
    found = []
    for name in specimens:
        stiffness = STIFFNESS * np.exp(rng.normal(0.0, 0.3, 3))
        tests = []
        for case in cases(levels, joints):
            q = np.zeros((len(levels), joints, 6))
            driven = AXES[case.test][1]
            of_test = law.get(case.test, linear) if isinstance(law, Mapping) else law
            for joint in range(joints):
                q[:, joint, driven] = of_test(joint, np.array(levels), stiffness[driven - 3])
            seen = q + sd * rng.standard_normal((cycles, *q.shape))
            if zeroed:
                seen = seen - seen[:, :1]
                seen[:, 0] = np.nan
            seen[..., :3] = np.nan
            tests.append(Repeats(case, seen))
        found.append(SpecimenReadings(name, frames(joints), tuple(tests)))
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


def model(specimen: str, stiffness: Array, joints: int = len(JOINTS)) -> SpineModel:
    """A weightless upright chain with linear bushings."""
    names, poses = JOINTS[:joints], frames(joints)
    bodies = tuple(
        Body(name, 1e-6, pose.origin, 1e-9 * np.eye(3))
        for name, pose in zip(names, poses, strict=True)
    )
    values = np.tile([1e5, 1e6, 1e5, *stiffness], (joints, 1))
    bushing = ScopedEffect(create("linear_bushing"), tuple(range(joints)), values)
    damping = np.ones((joints, 6))
    return SpineModel(specimen, names, poses, bodies, np.zeros(3), damping, (bushing,))


def start(given: Sequence[SpecimenReadings], grouping: str = "per_specimen") -> BaselineModels:
    """Where fits of the readings start: the same stiffness everywhere."""
    models = {r.specimen: model(r.specimen, STIFFNESS, len(r.frames)) for r in given}
    base = {name: base_parameters(m, grouping, ROTATIONS) for name, m in models.items()}
    return BaselineModels(models, base, 100.0)
