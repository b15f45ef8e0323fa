"""Job: what the motion of joints hangs on: specimen, joint frames or stiffness.

The grid of a study: motion at the largest load by specimen, pose, stiffness set, test, joint.

Job: how far joints move, over poses, stiffness sets and specimens.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import mode
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import loaded_coordinate
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.words import count
from spinepipe.sensitivity import Share, variance_shares
from spinepipe.sensitivity.shares import nested_shares
from spinepipe.statistics import Ended
from spinepipe.studies.range_of_motion.load_steps import all_cases
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.tables import FACTORS, ROM_SUMMARY, ROM_VARIANCE
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_COLUMNS, COORDINATE_UNITS, COORDINATES, ROTATIONS

ROWS_AT_A_TIME = 50_000
_KEYS = ("specimen", "pose", "stiffness", "test", "joint", "largest_load")
_MOTION = tuple(f"predicted_{name}" for name in COORDINATE_COLUMNS)


@dataclass(frozen=True, eq=False)
class Grid:
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


def read_grid(path: str, study: RangeOfMotion, cohort: Cohort) -> Grid:
    """Rows of the largest loads of ``range_of_motion.parquet``, read some at a time."""
    tests = _tests(study, cohort)
    sizes = (len(cohort.specimen_names), study.n_poses, study.stiffness_sets, len(tests))
    motion = np.full((*sizes, len(cohort.joint_names), 6), np.nan)
    asked = np.zeros(sizes, dtype=bool)
    names = {"specimen": cohort.specimen_names, "test": tests, "joint": cohort.joint_names}
    for rows in pq.ParquetFile(path).iter_batches(ROWS_AT_A_TIME, columns=[*_KEYS, *_MOTION]):
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
    return Grid(cohort.specimen_names, tests, cohort.joint_names, loaded, motion, asked)


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


EVERY = "*"
_QUANTILES = {
    "median": 50.0,
    "low_quartile": 25.0,
    "high_quartile": 75.0,
    "percentile_5": 5.0,
    "percentile_95": 95.0,
}


def summary(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``rom_summary.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    grid = read_grid(tables[0], settings, cohort)
    made_by = provenance("rom_summary", settings, cohort)
    write(from_rows(ROM_SUMMARY, list(summary_rows(grid))), output, made_by)


def summary_rows(grid: Grid) -> Iterator[dict[str, Any]]:
    """Rows of each specimen and, where there are several, of all of them together."""
    groups = [(name, slice(at, at + 1)) for at, name in enumerate(grid.specimens)]
    if len(groups) > 1:
        groups.append((EVERY, slice(None)))
    for specimen, which in groups:
        for number, test in enumerate(grid.tests):
            asked = grid.asked[which, :, :, number]
            if asked.any():
                motion = grid.motion[which, :, :, number][asked]
                for row in _test_rows(grid, motion, grid.loaded[number]):
                    yield {"specimen": specimen, "test": test, **row}


def _test_rows(grid: Grid, motion: Array, loaded: str) -> Iterator[dict[str, Any]]:
    """Rows of one test; motion (runs, J, 6). A run has an equilibrium of all joints or of none."""
    solved = motion[np.isfinite(motion).all(axis=(1, 2))]
    numbers = {"n": len(solved), "n_without": len(motion) - len(solved)}
    found = _quantiles(solved)
    ended = (Ended.DONE, "") if len(solved) else (Ended.TOO_FEW, "no run has an equilibrium")
    for joint, name in enumerate(grid.joints):
        for at, coordinate in enumerate(COORDINATES):
            yield {
                "joint": name,
                "coordinate": coordinate,
                "role": "loaded" if coordinate == loaded else "coupled",
                "unit": COORDINATE_UNITS[coordinate],
                **numbers,
                **dict(zip(_QUANTILES, found[:, joint, at].tolist(), strict=True)),
                "status": ended[0].value,
                "message": ended[1],
            }


def _quantiles(solved: Array) -> NDArray[np.float64]:
    """(quantiles, J, 6), NaN where there is nothing."""
    if not len(solved):
        return np.full((len(_QUANTILES), *solved.shape[1:]), np.nan)
    return np.percentile(solved, list(_QUANTILES.values()), axis=0)


FEWEST_COMPLETE = 0.5
"""A specimen whose share of complete poses is smaller takes no part in the cohort's analysis."""


_OURS = {"row": "pose", "column": "stiffness", "draw": "pose", "treatment": "stiffness"}
"""What the analyses call in general terms, and what it is here."""

_GENERAL = re.compile(rf"\b({'|'.join(_OURS)})\b")


def variance(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``rom_variance.parquet``."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    grid = read_grid(tables[0], settings, cohort)
    made_by = provenance("rom_variance", settings, cohort)
    write(from_rows(ROM_VARIANCE, list(variance_rows(grid))), output, made_by)


def variance_rows(grid: Grid) -> Iterator[dict[str, Any]]:
    """Rows of each specimen and, where there are several, of the cohort."""
    for number, test in enumerate(grid.tests):
        drawn = grid.loaded_motion(number)[:, 1:, 1:]  # the first pose and set are no draws
        same = {"test": test, "coordinate": grid.loaded[number]}
        tested = np.flatnonzero(grid.asked[:, :, :, number].any(axis=(1, 2)))
        complete = [_complete(drawn[at]) for at in tested]
        names = [grid.specimens[at] for at in tested]
        for specimen, motion in zip(names, complete, strict=True):
            yield from ({**same, "specimen": specimen, **row} for row in _own(grid, motion))
        if len(names) > 1:
            yield from ({**same, "specimen": EVERY, **row} for row in _all(grid, complete))


def _complete(motion: Array) -> Array:
    """Motion (poses, K, J) of the poses that have an equilibrium with every stiffness set."""
    whole: Array = motion[np.isfinite(motion).all(axis=(1, 2))]
    return whole


def _own(grid: Grid, motion: Array) -> Iterator[dict[str, Any]]:
    """Rows of one specimen, joint by joint; motion (poses, K, J)."""
    for at, joint in enumerate(grid.joints):
        found = variance_shares(motion[:, :, at])
        parts = {"pose": found.row, "stiffness": found.column, "rest": found.interaction}
        ended = (found.status, found.message)
        yield {"joint": joint, **_row(motion[None, :, :, at], ended, parts)}


def _all(grid: Grid, motions: list[Array]) -> Iterator[dict[str, Any]]:
    """Rows of the cohort, joint by joint: as many poses of each specimen as all of them have."""
    most = max(len(motion) for motion in motions)
    kept = [motion for motion in motions if len(motion) >= max(1.0, FEWEST_COMPLETE * most)]
    if not kept:
        empty = motions[0][None]
        ended = (Ended.TOO_FEW, "no pose has an equilibrium with every stiffness set")
        yield from ({"joint": joint, **_row(empty[..., 0], ended, {})} for joint in grid.joints)
        return
    poses = min(len(motion) for motion in kept)
    values = np.stack([motion[:poses] for motion in kept])
    left_out = _left_out(len(motions) - len(kept), most - poses)
    for at, joint in enumerate(grid.joints):
        found = nested_shares(values[..., at])
        parts = {
            "specimen": found.specimen,
            "pose": found.draw,
            "stiffness": found.treatment,
            "rest": found.rest,
        }
        message = "; ".join(part for part in (found.message, left_out) if part)
        yield {"joint": joint, **_row(values[..., at], (found.status, message), parts)}


def _left_out(specimens: int, poses: int) -> str:
    """What is missing for lack of equilibria."""
    parts = [count(specimens, "specimen")] * (specimens > 0)
    parts += [f"up to {count(poses, 'pose')} of a specimen"] * (poses > 0)
    return f"left out for lack of equilibria: {', '.join(parts)}" if parts else ""


def _row(values: Array, ended: tuple[Ended, str], parts: dict[str, Share | None]) -> dict[str, Any]:
    """Columns of an analysis of values (S, P, K)."""
    specimens, poses, stiffnesses = values.shape
    done = ended[0] is Ended.DONE
    shares = {
        f"{name}_{end}": getattr(parts.get(name), field, None)
        for name in FACTORS
        for end, field in (("share", "estimate"), ("low", "low"), ("high", "high"))
    }
    return {
        "n_specimens": specimens,
        "n_poses": poses,
        "n_stiffness": stiffnesses,
        "sd": float(values.std(ddof=1)) if done else None,
        **shares,
        "status": ended[0].value,
        "message": _GENERAL.sub(lambda word: _OURS[word[0]], ended[1]),
    }
