"""Job: motion of one specimen with sets of joint frames and of stiffness, in all tests."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import on_bushings
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.frames import Pose
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import KEPT_SPECIMENS, study_of_kind
from spinepipe.model import RefusedModel
from spinepipe.statics.batched import Stack
from spinepipe.status import Status
from spinepipe.studies.range_of_motion.grid import asked_tests, virtual_tensions
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import RANGE_OF_MOTION
from spinepipe.studies.selected_tests import SelectedTest
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, MM_PER_M, ROTATIONS, STIFFNESS_COLUMNS, from_si

Ends = list[tuple[Array, Status, str]]
"""End of each stored step: motion (J, 6) in mm and deg, NaN where there is none; how, and why."""


def run(
    root: str,
    study: str,
    frames: str,
    stiffness_sets: str,
    specimen: str,
    parts: Mapping[str, Mapping[str, str]],
) -> None:
    """Write the rows of joint frames and stiffness sets, a file each."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    tests = asked_tests(root, study, specimen, cohort.digest)
    drawn = [mark_of(frames), mark_of(stiffness_sets)]
    made_by = provenance("simulate", settings, cohort, [specimen], drawn)
    for path, place in parts.items():
        placed = drawn_frames(stamp(frames)).of(specimen, int(place["pose"]))
        values = drawn_stiffness(stamp(stiffness_sets))[int(place["stiffness"])]
        ends = _solved(settings, cohort, specimen, placed, values, tests)
        columns = _columns(cohort.joint_names, zip(tests, ends, strict=True))
        of = {
            "specimen": specimen,
            "pose": int(place["pose"]),
            "stiffness": int(place["stiffness"]),
        }
        write(to_arrow(RANGE_OF_MOTION, columns, **of), path, made_by)


def _solved(
    settings: RangeOfMotion,
    cohort: Cohort,
    specimen: str,
    placed: tuple[Pose, ...],
    values: Array,
    tests: Sequence[SelectedTest],
) -> list[Ends]:
    """Ends of the stored steps of one spine, test by test; refused where it is none."""
    damping = np.array(settings.damping.in_order())
    try:
        tension_n = virtual_tensions(settings)
        model = on_bushings(cohort, specimen, placed, values, damping, tension_n=tension_n)
    except RefusedModel as error:
        nowhere = np.full(values.shape, np.nan)
        return [
            [(nowhere, Status.REFUSED, str(error))] * len(test.case.steps[test.stored])
            for test in tests
        ]
    # All tests are solved in one stack. Without an equilibrium in step 0 there is none in later
    # steps, as they are followed from it.
    stack = Stack.of([model], [(0, test.case) for test in tests])
    found = stack.solve()
    ends = []
    for test, (first, end) in zip(tests, pairwise(stack.first), strict=True):
        start = found.q[first] if test.from_first else 0.0
        lanes = range(first, end)[test.stored]
        ends.append(
            [
                (from_si(found.q[n] - start), Status(found.status[n]), found.messages.get(n, ""))
                for n in lanes
            ]
        )
    return ends


def _columns(
    joints: tuple[str, ...], tests: Iterable[tuple[SelectedTest, Ends]]
) -> dict[str, list[Any]]:
    """Columns of a job file; rows step by step, joint by joint."""
    names = ("test", "step", "largest_load", "joint", "status", "message")
    columns: dict[str, list[Any]] = {name: [] for name in names}
    motions = []
    for test, ends in tests:
        for step, (motion, status, message) in zip(test.case.steps[test.stored], ends, strict=True):
            same = (test.case.test, step.step, step.step == test.largest)
            for name, value in zip(names[:3], same, strict=True):
                columns[name] += [value] * len(joints)
            columns["joint"] += joints
            columns["status"] += [status.value] * len(joints)
            columns["message"] += [message] * len(joints)
            motions.append(motion)
    # Steps follow one another with all their joints, as the columns above do.
    predicted = np.concatenate(motions).T
    return {
        **columns,
        **dict(zip([f"predicted_{c}" for c in COORDINATE_COLUMNS], predicted, strict=True)),
    }


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


@lru_cache(maxsize=KEPT_SPECIMENS)
def drawn_frames(where: Stamp) -> DrawnFrames:
    """Frames of a specimen, from the file that `sample_frames` wrote."""
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


@lru_cache(maxsize=2)
def drawn_stiffness(where: Stamp) -> Array:
    """(sets, J, 6) stiffness of ``stiffness_sets.parquet``, SI."""
    table = read_frame(where[0])
    values: Array = table[list(STIFFNESS_COLUMNS)].to_numpy(float)
    return values.reshape(table["stiffness"].nunique(), -1, 6)
