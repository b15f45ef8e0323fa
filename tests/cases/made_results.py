"""Study, cohort and made-up results of every kind of study, as its report is given them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import cohort_study_cases
import discrepancy_cases
import grid_cases
import numpy as np
import pandas as pd
import pose_tables
import scoliosis_cases
import study_cases
import tracking_table_cases
import trunk_table_cases
from chain_cases import JOINTS, Chains

from spinepipe.cohort import Cohort, read
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import INDICES
from spinepipe.studies.range_of_motion.grid import read_grid
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.summary import summary_rows
from spinepipe.studies.range_of_motion.variance import variance_rows
from spinepipe.studies.read import check
from spinepipe.studies.study import Study
from spinepipe.tables import StudyTables, from_rows


@dataclass(frozen=True, eq=False)
class Made:
    """A study, its cohort and its tables; and whether the cohort names the vertebrae."""

    study: Study
    cohort: Cohort
    tables: StudyTables
    own_vertebrae: bool = True


def made(kind: str, root: Path) -> Made:
    """Results of a small study of that kind; `root` is an empty folder."""
    return MAKERS[kind](root)


def _poses(root: Path) -> Made:
    study, cohort = check(study_cases.project(root, study_cases.Size(("a",))), study_cases.STUDY)
    return Made(study, cohort, StudyTables(pose_tables.frames(pose_tables.whole())))


def _of_size(cases: Any, size: Any, own_vertebrae: bool = True) -> Callable[[Path], Made]:
    """Of cases that make all three of a `Size`."""

    def make(_: Path) -> Made:
        tables = cases.tables_of(size)
        rows = tables if isinstance(tables, StudyTables) else StudyTables(tables)
        return Made(cases.study_of(size), cases.cohort_of(size), rows, own_vertebrae)

    return make


def _grid(root: Path) -> Made:
    grid_cases.made_up(root, (2, 3, 2))
    path, _ = grid_cases.table_of(root, (2, 3, 2))
    study, cohort = check(root, grid_cases.STUDY)
    assert isinstance(study, RangeOfMotion)
    grid = read_grid(str(path), study, cohort)
    rows = {"rom_summary": summary_rows(grid), "rom_variance": variance_rows(grid)}
    return Made(
        study, cohort, StudyTables({name: pd.DataFrame(found) for name, found in rows.items()})
    )


def _search(root: Path) -> Made:
    discrepancy_cases.project(root)
    study, cohort = check(root, discrepancy_cases.STUDY)
    answer = "SET"
    rows = discrepancy_cases.frames(answer)
    verdict = discrepancy_cases.VERDICTS[answer]
    return Made(study, cohort, discrepancy_cases.tables(verdict, rows, root))


def _indices(root: Path) -> Made:
    stiffness = np.array([[50.0, 60.0, 200.0]] * len(JOINTS))
    Chains({"a": stiffness, "b": stiffness}, TESTS, steps=4).write(root)
    cohort = read(root / "config" / "cohorts" / "chains")
    factors = [{"of": "load_size", "times": {"low": 0.9, "high": 1.1}}]
    asked = {"study": "probe", "kind": "global_sensitivity", "cohort": "chains"}
    design = {"method": "sobol", "samples": 256}
    study = GlobalSensitivity.model_validate(asked | {"factors": factors, "design": design})
    rows = [_index(*place) for place in product("ab", TESTS, JOINTS, ("S1", "ST"), SHARES)]
    return Made(study, cohort, StudyTables({"indices": from_rows(INDICES, rows).to_pandas()}))


TESTS = ("flexion", "left_axial_rotation")
SHARES = {"load_size": 0.9, "dummy": 0.0}


def _index(specimen: str, test: str, joint: str, index: str, factor: str) -> dict[str, Any]:
    share = SHARES[factor]
    told = {"specimen": specimen, "test": test, "joint": joint, "index": index, "factor": factor}
    told |= {"output": "motion", "coordinate": "extension", "step": 3, "other": ""}
    told |= {"estimate": share, "ci_low": share, "ci_high": share, "conditional": False}
    told |= {"runs": 768, "failed": 0, "floor_replicates": 0, "status": "done", "message": "none"}
    return {column.name: told.get(column.name) for column in INDICES.columns}


MAKERS: Mapping[str, Callable[[Path], Made]] = {
    "joint_pose_sensitivity": _poses,
    "cohort_stiffness": _of_size(cohort_study_cases, cohort_study_cases.Size()),
    "discrepancy": _search,
    "global_sensitivity": _indices,
    "range_of_motion": _grid,
    "scoliosis": _of_size(scoliosis_cases, scoliosis_cases.Size(1)),
    "tracking": _of_size(
        tracking_table_cases,
        tracking_table_cases.Size(1, ("stance",)),
        own_vertebrae=False,
    ),
    "trunk_loads": _of_size(
        trunk_table_cases,
        trunk_table_cases.Size(1, ("standing", "load_away"), (), samples=False),
        own_vertebrae=False,
    ),
}
