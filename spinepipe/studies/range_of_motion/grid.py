"""The grid of a study: motion at the largest load by specimen, pose, stiffness set, test, joint."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import mode

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import loaded_coordinate
from spinepipe.effects.contract import Array
from spinepipe.studies.range_of_motion.load_steps import all_cases
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.tables import opened
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS

ROWS_AT_A_TIME = 50_000
_KEYS = ("specimen", "pose", "stiffness", "test", "joint", "largest_load")
_MOTION = tuple(f"predicted_{name}" for name in COORDINATE_COLUMNS)


@dataclass(frozen=True, eq=False)
class MotionGrid:
    """Motion of a whole study.

    Attributes
    ----------
    loaded : the coordinate that each test turns: that of its largest moment; of tests without
        moments the rotation that moves most.
    motion : (S, P, K, T, J, 6) mm and deg, NaN without equilibrium.
    asked : (S, P, K, T) whether the specimen has the test at all.
    """

    specimens: tuple[str, ...]
    tests: tuple[str, ...]
    joints: tuple[str, ...]
    loaded: tuple[str, ...]
    motion: Array
    asked: NDArray[np.bool_]

    def loaded_motion(self, test: int) -> Array:
        """(S, P, K, J) motion in the coordinate that a test turns, deg."""
        chosen: Array = self.motion[:, :, :, test, :, COORDINATES.index(self.loaded[test])]
        return chosen


def read_grid(path: str, study: RangeOfMotion, cohort: Cohort) -> MotionGrid:
    """Rows of the largest loads of ``range_of_motion.parquet``, read some at a time."""
    tests = _tests(study, cohort)
    sizes = (len(cohort.specimen_names), study.n_poses, study.stiffness_sets, len(tests))
    motion = np.full((*sizes, len(cohort.joint_names), 6), np.nan)
    asked = np.zeros(sizes, dtype=bool)
    names = {"specimen": cohort.specimen_names, "test": tests, "joint": cohort.joint_names}
    with opened(path) as file:
        for rows in file.iter_batches(ROWS_AT_A_TIME, columns=[*_KEYS, *_MOTION]):
            rows = rows.filter(rows["largest_load"])
            at = {name: _positions(rows[name], values) for name, values in names.items()}
            at |= {name: rows[name].to_numpy() for name in ("pose", "stiffness")}
            place = tuple(at[name] for name in ("specimen", "pose", "stiffness", "test", "joint"))
            values = [rows[name].to_numpy(zero_copy_only=False) for name in _MOTION]
            motion[place] = np.column_stack(values)
            asked[place[:4]] = True
    driven = _driven(study, cohort)
    loaded = tuple(
        driven.get(test) or _moves_most(motion[:, :, :, i]) for i, test in enumerate(tests)
    )
    return MotionGrid(cohort.specimen_names, tests, cohort.joint_names, loaded, motion, asked)


def _positions(values: pa.Array, names: Sequence[str]) -> NDArray[np.int32]:
    """Place of each value among the names."""
    found: NDArray[np.int32] = pc.index_in(values, value_set=pa.array(names)).to_numpy(
        zero_copy_only=False
    )
    return found


def _tests(study: RangeOfMotion, cohort: Cohort) -> tuple[str, ...]:
    if study.virtual_tests is not None:
        return study.virtual_tests.tests
    return study.tests or cohort.tests


def _driven(study: RangeOfMotion, cohort: Cohort) -> dict[str, str]:
    """The coordinate that the largest moment of each test drives, in most specimens.

    Tests without a moment have none.
    """
    found: dict[str, list[str]] = {}
    for specimen in cohort.specimen_names:
        for case in all_cases(study, cohort, specimen):
            coordinate = loaded_coordinate(case)
            if coordinate is not None:
                found.setdefault(case.test, []).append(coordinate)
    return {test: mode(coordinates) for test, coordinates in found.items()}


def _moves_most(motion: Array) -> str:
    """The rotation that moves most; motion (..., 6)."""
    flat = np.abs(motion[..., 3:]).reshape(-1, 3)
    solved = flat[np.isfinite(flat).all(axis=1)]
    return ROTATIONS[int(np.median(solved, axis=0).argmax())] if len(solved) else ROTATIONS[0]
