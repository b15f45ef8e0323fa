"""The grid of a study: the load steps that are computed, and motion at the largest load.

Motion is by specimen, pose, stiffness set, test and joint.
"""

from dataclasses import dataclass
from functools import lru_cache
from statistics import mode

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import loaded_coordinate, virtual_load_cases
from spinepipe.cohort.specimen import followers, load_cases
from spinepipe.effects.contract import Array
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import LoadCase
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.selected_tests import SelectedTest, first_cycles, select_steps
from spinepipe.tables import opened
from spinepipe.units import COORDINATE_COLUMNS, ROTATIONS

ROWS_AT_A_TIME = 50_000
_KEYS = ("specimen", "pose", "stiffness", "test", "joint", "largest_load")
_MOTION = tuple(f"predicted_{name}" for name in COORDINATE_COLUMNS)


@lru_cache(maxsize=256)
def asked_tests(root: str, study: str, specimen: str, _digest: str) -> tuple[SelectedTest, ...]:
    """Tests of a specimen; ``_digest`` is that of its cohort."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    virtual = virtual_tensions(settings)
    tension_n = followers(cohort, specimen) if virtual is None else virtual
    return tuple(
        select_steps(
            case,
            cohort.gravity or tension_n.get(case.test, 0.0) > 0.0,
            settings.rows == "all_steps",
        )
        for case in all_cases(settings, cohort, specimen)
    )


def all_cases(settings: RangeOfMotion, cohort: Cohort, specimen: str) -> tuple[LoadCase, ...]:
    """All steps of the tests that the study asks for."""
    tests = settings.virtual_tests
    if tests is not None:
        top = len(cohort.joint_names) - 1
        return virtual_load_cases(tests.tests, tests.moment_nm, tests.steps, top)
    return first_cycles(load_cases(cohort, specimen, settings.tests or cohort.tests, np.zeros(3)))


def virtual_tensions(settings: RangeOfMotion) -> dict[str, float] | None:
    """Follower load in N of each virtual test; None: the tests are the cohort's, as it says."""
    asked_for = settings.virtual_tests
    return None if asked_for is None else dict.fromkeys(asked_for.tests, asked_for.follower_n)


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


def read_grid(path: str, study: RangeOfMotion, cohort: Cohort) -> MotionGrid:
    """Rows of the largest loads of ``range_of_motion.parquet``, read some at a time."""
    virtual = study.virtual_tests
    tests = (study.tests or cohort.tests) if virtual is None else virtual.tests
    sizes = (len(cohort.specimen_names), study.n_poses, study.stiffness_sets, len(tests))
    motion = np.full((*sizes, len(cohort.joint_names), 6), np.nan)
    tested = np.zeros(sizes, dtype=bool)
    names = {"specimen": cohort.specimen_names, "test": tests, "joint": cohort.joint_names}
    # Row groups are streamed: a large study has more rows than memory, and a grid of peaks fits.
    with opened(path) as file:
        for rows in file.iter_batches(ROWS_AT_A_TIME, columns=[*_KEYS, *_MOTION]):
            rows = rows.filter(rows["largest_load"])
            at = {  # places among the names
                name: pc.index_in(rows[name], value_set=pa.array(values)).to_numpy(
                    zero_copy_only=False
                )
                for name, values in names.items()
            }
            at |= {name: rows[name].to_numpy() for name in ("pose", "stiffness")}
            place = tuple(at[name] for name in ("specimen", "pose", "stiffness", "test", "joint"))
            values = [rows[name].to_numpy(zero_copy_only=False) for name in _MOTION]
            motion[place] = np.column_stack(values)
            tested[place[:4]] = True
    driven = _driven(study, cohort)
    loaded = []
    for index, test in enumerate(tests):
        if test in driven:
            loaded.append(driven[test])
            continue
        # The rotation that moves most, by the median over runs and joints; where nothing has an
        # equilibrium the first rotation.
        flat = np.abs(motion[:, :, :, index, :, 3:]).reshape(-1, 3)
        solved = flat[np.isfinite(flat).all(axis=1)]
        loaded.append(ROTATIONS[int(np.median(solved, axis=0).argmax()) if len(solved) else 0])
    names_of = cohort.specimen_names, tests, cohort.joint_names
    return MotionGrid(*names_of, tuple(loaded), motion, tested)


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
