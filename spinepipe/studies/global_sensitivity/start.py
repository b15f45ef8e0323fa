"""Where the variation of a specimen starts: its own spine, landmarks and tests.

Which load steps of which tests are computed for a specimen, and where its motion begins.

Joint frames of many landmark sets at once, each as `spinepipe.frames.joint_pose` makes it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_tests import peak_step
from spinepipe.cohort.specimen import joint_frames, landmarks, load_cases, spine_model
from spinepipe.effects import create
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, SMALLEST_LENGTH_M, SMALLEST_SINE, Pose, joint_pose
from spinepipe.model import LoadCase, LoadStep, ScopedEffect, SpineModel


@dataclass(frozen=True)
class AskedTest:
    """A test of which some steps are computed.

    Attributes
    ----------
    case : the steps to compute.
    from_first : whether motion counts from the first step of the case, which is step 0; otherwise
        from the neutral pose.
    stored : which steps of the case become rows.
    """

    case: LoadCase
    from_first: bool
    stored: slice

    @property
    def steps(self) -> tuple[int, ...]:
        """Numbers of the steps that become rows."""
        return tuple(step.step for step in self.case.steps[self.stored])


def asked_tests(
    cohort: Cohort, specimen: str, tests: Sequence[str], all_steps: bool
) -> tuple[AskedTest, ...]:
    """The first cycle of each of the tests that the specimen has.

    Motion counts as the cohort's does: from step 0 where that was subtracted.

    Parameters
    ----------
    cohort : with loads.
    all_steps : all load steps, or that of the largest load only.
    """
    first: dict[str, LoadCase] = {}
    for case in load_cases(cohort, specimen, tests, np.zeros(3)):
        first.setdefault(case.test, case)
    return tuple(_asked(case, cohort, all_steps) for case in first.values())


def _asked(case: LoadCase, cohort: Cohort, all_steps: bool) -> AskedTest:
    """Joints have no memory, so the largest load can be computed without the steps before it."""
    # where nothing acts in step 0, that is the neutral pose and need not be subtracted
    from_first = cohort.zeroed_at_step_0 and (cohort.gravity or _loaded(case.steps[0]))
    if all_steps:
        return AskedTest(case, from_first, slice(None))
    largest = case.steps[peak_step(case)]
    if not from_first or largest is case.steps[0]:
        return AskedTest(replace(case, steps=(largest,)), from_first, slice(None))
    return AskedTest(replace(case, steps=(case.steps[0], largest)), from_first, slice(1, None))


def _loaded(step: LoadStep) -> bool:
    """Whether anything acts; loads that balance each other still press and bend."""
    return any(wrench.force.any() or wrench.moment.any() for wrench in step.wrenches)


Flags = NDArray[np.bool_]

SUPERIOR, INFERIOR, LEFT, RIGHT = range(len(FRAME_LANDMARKS))
"""Places of the landmarks, in the order of `FRAME_LANDMARKS`."""


@dataclass(frozen=True, eq=False)
class ManyFrames:
    """One joint's frame of M landmark sets.

    Attributes
    ----------
    rotations : (M, 3, 3); the identity where there is no frame.
    origins : (M, 3) m, ground.
    defined : (M,) whether the landmarks define a frame.
    """

    rotations: Array
    origins: Array
    defined: Flags


def many_joint_frames(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> ManyFrames:
    """Frames of a joint from landmarks (M, 4, 3) m of its two vertebrae, see `joint_pose`.

    Parameters
    ----------
    in_lower, in_upper : (4,) which landmarks a vertebra has; those of the facing endplates are
        there, and one of the two vertebrae has all. What it has not may hold any number.
    """
    sides = [points for points, there in ((lower, in_lower), (upper, in_upper)) if there.all()]
    rotations, defined = zip(*(_vertebra_rotations(points) for points in sides), strict=True)
    whole: Flags = np.logical_and.reduce(defined)
    stacked = np.stack(rotations, axis=1)
    stacked[~whole] = np.eye(3)
    mean = Rotation.from_matrix(stacked).mean(axis=1).as_matrix()
    return ManyFrames(mean, (upper[:, INFERIOR] + lower[:, SUPERIOR]) / 2.0, whole)


def why_none(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> str:
    """Why one landmark set (4, 3) of each vertebra defines no frame."""
    try:
        one_joint_frame(lower, upper, in_lower, in_upper)
    except ValueError as error:
        return str(error)
    return "the landmarks are at the edge of defining no frame"


def one_joint_frame(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> Pose:
    """The frame of one landmark set (4, 3) of each vertebra, by `joint_pose` itself."""
    sides = ((lower, in_lower), (upper, in_upper))
    named = (
        {name: p for name, p, there in zip(FRAME_LANDMARKS, points, given, strict=True) if there}
        for points, given in sides
    )
    return joint_pose(*named)


def _vertebra_rotations(points: Array) -> tuple[Array, Flags]:
    """(M, 3, 3) ISB axes of a vertebra and (M,) whether there are any, from (M, 4, 3) landmarks."""
    z, wide = _directions(points[:, LEFT], points[:, RIGHT])
    y0, high = _directions(points[:, INFERIOR], points[:, SUPERIOR])
    normal = np.cross(y0, z)
    sine = np.linalg.norm(normal, axis=1)
    defined = wide & high & (sine >= SMALLEST_SINE)
    x = normal / np.where(defined, sine, 1.0)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2), defined


def _directions(start: Array, end: Array) -> tuple[Array, Flags]:
    """(M, 3) unit vectors, and (M,) whether the points are far enough apart to have one."""
    line = end - start
    length = np.linalg.norm(line, axis=1)
    apart = length >= SMALLEST_LENGTH_M
    return line / np.where(apart, length, 1.0)[:, None], apart


BUSHING = "linear_bushing"


@dataclass(frozen=True, eq=False)
class Start:
    """A specimen as the cohort describes it.

    Attributes
    ----------
    model : its spine on linear bushings, the model's only effect.
    vertebrae : caudal to cranial; the first is fixed.
    points : (J + 1, 4, 3) m, ground: landmarks that make frames; zero where there is none.
    known : (J + 1, 4) which of them there are.
    given : (J,) joints whose frame ``joints.csv`` gives, whatever the landmarks are.
    tests : its tests.
    """

    model: SpineModel
    vertebrae: tuple[str, ...]
    points: Array
    known: Flags
    given: Flags
    tests: tuple[AskedTest, ...]


def start_of(
    cohort: Cohort,
    specimen: str,
    stiffness: Array,
    damping: Array,
    tests: Sequence[str],
    all_steps: bool,
) -> Start:
    """A specimen of a cohort with loads.

    Parameters
    ----------
    stiffness : (6,) or (J, 6) N/m and N m/rad. damping : (6,) N s/m and N m s/rad.
    tests : names of tests; those that the specimen does not have are left out.
    all_steps : all load steps, or that of the largest load only.
    """
    n = len(cohort.joint_names)
    values = np.broadcast_to(stiffness, (n, 6)).copy()
    bushing = ScopedEffect(create(BUSHING), tuple(range(n)), values)
    frames = joint_frames(cohort, specimen)
    return Start(
        spine_model(cohort, specimen, frames, (bushing,), damping),
        cohort.vertebrae,
        *frame_landmarks(cohort, specimen),
        given_joints(cohort, specimen),
        asked_tests(cohort, specimen, tests, all_steps),
    )


def frame_landmarks(cohort: Cohort, specimen: str) -> tuple[Array, Flags]:
    """Points (J + 1, 4, 3) m, and which of them there are (J + 1, 4)."""
    points = np.zeros((len(cohort.vertebrae), len(FRAME_LANDMARKS), 3))
    known = np.zeros(points.shape[:2], dtype=bool)
    found = {} if cohort.landmarks is None else landmarks(cohort, specimen)
    for row, vertebra in enumerate(cohort.vertebrae):
        for column, name in enumerate(FRAME_LANDMARKS):
            point = found.get(vertebra, {}).get(name)
            if point is not None:
                points[row, column], known[row, column] = point, True
    return points, known


def given_joints(cohort: Cohort, specimen: str) -> Flags:
    """(J,) joints whose frame ``joints.csv`` gives."""
    if cohort.joints is None:
        return np.zeros(len(cohort.joint_names), dtype=bool)
    rows = cohort.joints[cohort.joints["specimen"] == specimen]
    return np.isin(cohort.joint_names, rows["joint"])


def moved_by(known: Flags, given: Flags, vertebra: int, landmark: int) -> list[int]:
    """Joints whose frame a landmark has a part in."""
    whole = [bool(row.all()) for row in known]
    facing = {vertebra: SUPERIOR, vertebra - 1: INFERIOR}  # of the joint above, and of that below
    return [
        joint
        for joint, (lower, upper) in enumerate(pairwise(range(len(known))))
        if vertebra in (lower, upper)
        and known[vertebra, landmark]
        and not given[joint]
        and (whole[vertebra] or facing[joint] == landmark)
    ]
