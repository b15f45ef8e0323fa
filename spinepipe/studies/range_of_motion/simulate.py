"""Job: motion of one specimen with one set of joint frames, all tests and stiffness sets."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.cohort.specimen import on_bushings
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.frames import Pose
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics.many import Stack
from spinepipe.status import Status
from spinepipe.studies.asked_tests import AskedTest
from spinepipe.studies.range_of_motion.load_steps import asked_tests, virtual_tensions
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import RANGE_OF_MOTION
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, MM_PER_M, ROTATIONS, STIFFNESS_COLUMNS, from_si

TABLE = RANGE_OF_MOTION.without("specimen")
"""A job file: the specimen is in its folder's name."""

Ends = list[tuple[Array, Status, str]]
"""End of each stored step: motion (J, 6) in mm and deg, NaN where there is none; how, and why."""

_SPECIMENS = 128
"""Whose frames are kept: jobs of different specimens come in any order."""


def run(
    root: str,
    study: str,
    frames: str,
    stiffness_sets: str,
    specimen: str,
    pose: str,
    output: str,
) -> None:
    """Write the rows of one specimen and pose, of all stiffness sets."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    tests = asked_tests(root, study, specimen, cohort.digest)
    placed = drawn_frames(frames).of(specimen, int(pose))
    damping = np.array(settings.damping.in_order())
    tension_n = virtual_tensions(settings)
    sets = drawn_stiffness(stiffness_sets)
    models: dict[int, SpineModel] = {}
    refusals: dict[int, str] = {}
    for number, values in enumerate(sets):
        try:
            models[number] = on_bushings(
                cohort, specimen, placed, values, damping, tension_n=tension_n
            )
        except RefusedModel as error:
            refusals[number] = str(error)
    solved = iter(_ends(tuple(models.values()), tests))
    names = ("stiffness", *_NAMES, *_MOTION)
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for number in range(len(sets)):
        nowhere = (np.full(sets[number].shape, np.nan), Status.REFUSED, refusals.get(number, ""))
        for test in tests:
            steps = test.case.steps[test.stored]
            ends = [nowhere] * len(steps) if number in refusals else next(solved)
            _enter(columns, cohort.joint_names, (number, test), ends)
    columns["pose"] = [int(pose)] * len(columns["stiffness"])
    made_by = provenance("simulate", settings, cohort, [specimen])
    write(to_arrow(TABLE, columns), output, made_by)


def _ends(models: Sequence[SpineModel], tests: Sequence[AskedTest]) -> Iterator[Ends]:
    """Ends of the steps that are stored, model by model and test by test; all solved together.

    Without an equilibrium in step 0 there is none in later steps, as they are followed from it.
    """
    if not models:
        return
    runs = [(number, test) for number in range(len(models)) for test in tests]
    stack = Stack.of(models, [(number, test.case) for number, test in runs])
    found = stack.solve()
    for (_, test), first, end in zip(runs, stack.first[:-1], stack.first[1:], strict=True):
        start = found.q[first] if test.from_first else 0.0
        yield [
            (
                from_si(found.q[lane] - start),
                Status(found.status[lane]),
                found.messages.get(lane, ""),
            )
            for lane in range(first, end)[test.stored]
        ]


_NAMES = ("test", "step", "largest_load", "joint", "status", "message")
_MOTION = tuple(f"predicted_{name}" for name in COORDINATE_COLUMNS)


def _enter(
    columns: dict[str, list[Any]],
    joints: tuple[str, ...],
    asked: tuple[int, AskedTest],
    ends: Ends,
) -> None:
    """Add the rows of a stiffness set under a test, step by step and joint by joint."""
    number, test = asked
    for step, (motion, status, message) in zip(test.case.steps[test.stored], ends, strict=True):
        load = (test.case.test, step.step, step.step == test.largest)
        for at, joint in enumerate(joints):
            row = (number, *load, joint, status.value, message, *motion[at])
            for values, value in zip(columns.values(), row, strict=True):
                values.append(value)


@dataclass(frozen=True, eq=False)
class DrawnFrames:
    """Joint frames of all poses.

    Attributes
    ----------
    rows : (specimen, pose) to the first row of its frames.
    n_joints : rows of one pose.
    origins, rotations : (rows, 3) m and (rows, 3, 3).
    """

    rows: dict[tuple[str, int], int]
    n_joints: int
    origins: Array
    rotations: Array

    def of(self, specimen: str, pose: int) -> tuple[Pose, ...]:
        """Frames of one pose, caudal to cranial."""
        first = self.rows[specimen, pose]
        at = range(first, first + self.n_joints)
        return tuple(Pose(self.rotations[row], self.origins[row]) for row in at)


def drawn_frames(path: str) -> DrawnFrames:
    """Frames of a specimen, from the file that `sample_frames` wrote."""
    return _frames(stamp(path))


@lru_cache(maxsize=_SPECIMENS)
def _frames(where: Stamp) -> DrawnFrames:
    table = read_frame(where[0])
    n = table["joint"].nunique()
    keys = zip(table["specimen"][::n], table["pose"][::n].astype(int), strict=True)
    angles = np.deg2rad(table[[f"{name}_deg" for name in ROTATIONS]].to_numpy(float))
    return DrawnFrames(
        {key: n * index for index, key in enumerate(keys)},
        n,
        table[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M,
        Rotation.from_euler("ZXY", angles).as_matrix(),
    )


def drawn_stiffness(path: str) -> Array:
    """(sets, J, 6) stiffness of ``stiffness_sets.parquet``, SI."""
    return _stiffness(stamp(path))


@lru_cache(maxsize=2)
def _stiffness(where: Stamp) -> Array:
    table = read_frame(where[0])
    values: Array = table[list(STIFFNESS_COLUMNS)].to_numpy(float)
    return values.reshape(table["stiffness"].nunique(), -1, 6)
