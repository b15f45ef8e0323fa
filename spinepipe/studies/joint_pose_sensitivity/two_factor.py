"""Job: joint pose against stiffness, by shares of variance and by a regression tree."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.designs import specimen_seed
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.marks import read_json
from spinepipe.sensitivity_analysis.shares import VarianceShare, VarianceShares, variance_shares
from spinepipe.sensitivity_analysis.tree import Tree, regression_tree
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import IMPORTANCE, VARIANCE_SHARES
from spinepipe.studies.joint_pose_sensitivity.variables import (
    absolute_error,
    complete_grid,
    measured_coordinates,
    pose_parameters,
    readings,
    signed_error,
)
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATES


def run(
    root: str, study: str, tables: list[str], best: str, variance_shares: str, importance: str
) -> None:
    """Write ``variance_shares.parquet`` and ``importance.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    simulations = readings(frames["simulations"], cohort.zeroed_at_step_0)
    kept = frames["success"].loc[frames["success"]["reduced"], ["specimen", "pose"]]
    errors, signed = (
        found.merge(kept, on=["specimen", "pose"])
        for found in (absolute_error(simulations), signed_error(simulations))
    )
    ranked_sets = read_json(best)
    divided: list[dict[str, Any]] = []
    grown: list[dict[str, Any]] = []
    for specimen in cohort.specimen_names:
        own, own_signed = (every[every["specimen"] == specimen] for every in (errors, signed))
        poses = frames["poses"]
        parameters = pose_parameters(poses[poses["specimen"] == specimen])
        for joint, coordinate in measured_coordinates(own):
            grid = complete_grid(own, joint, coordinate)
            key = {"specimen": specimen, "joint": joint, "coordinate": coordinate}
            both = grid, complete_grid(own_signed, joint, coordinate)
            divided += [{**key, **row} for row in _shares(*both)]
            seed = specimen_seed(settings.seed, f"tree/{specimen}/{joint}/{coordinate}")
            sets = {one["name"]: np.array(one["stiffness"]) for one in ranked_sets[specimen]}
            tree = TreeData(settings, cohort.joint_names, parameters, sets, seed)
            grown += [{**key, **row} for row in tree.rows(grid)]
    origin = provenance("two_factor", settings, cohort)
    write(from_rows(VARIANCE_SHARES, divided), variance_shares, origin)
    write(from_rows(IMPORTANCE, grown), importance, origin)


def _shares(grid: pd.DataFrame, signed: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Three rows: pose, stiffness and what only both together explain, of |error| and error."""
    found = variance_shares(grid.to_numpy(float))
    parts = _by_factor(found)
    of_signed = _by_factor(variance_shares(signed.to_numpy(float)))
    for factor, (first, total) in parts.items():
        told = _interval(of_signed[factor][0])
        yield {
            "factor": factor,
            **_interval(first),
            **{f"signed_{name}": value for name, value in told.items()},
            "total": None if total is None else total.estimate,
            "n_poses": found.n_rows,
            "n_stiffness": found.n_columns,
            "status": found.status.value,
            "message": found.message.replace("row", "pose").replace("column", "stiffness"),
        }


def _by_factor(
    found: VarianceShares,
) -> dict[str, tuple[VarianceShare | None, VarianceShare | None]]:
    """First order and total of each factor."""
    return {
        "pose": (found.row, found.total_row),
        "stiffness": (found.column, found.total_column),
        "interaction": (found.interaction, found.interaction),
    }


def _interval(share: VarianceShare | None) -> dict[str, float | None]:
    if share is None:
        return {"share": None, "share_low": None, "share_high": None}
    return {"share": share.estimate, "share_low": share.low, "share_high": share.high}


@dataclass(frozen=True)
class TreeData:
    """What a tree is grown on: pose parameters (deg, mm) and the fitted stiffnesses' logarithms.

    Attributes
    ----------
    sets : (J or 1, 6) stiffness of each best set.
    """

    settings: JointPoseSensitivity
    joints: Sequence[str]
    parameters: pd.DataFrame
    sets: dict[str, Array]
    seed: int

    def rows(self, grid: pd.DataFrame) -> Iterator[dict[str, Any]]:
        """One row per predictor."""
        free = self.settings.calibration.free
        of_pose = [str(name) for name in self.parameters.columns]
        of_stiffness = [f"{name}_stiffness" for name in free]
        if self.settings.calibration.grouping == "per_joint":
            of_stiffness = [f"{joint}_{name}" for joint in self.joints for name in of_stiffness]
        pose = self.parameters.loc[grid.index].to_numpy(float)
        columns = [COORDINATES.index(name) for name in free]
        sets = [np.log(self.sets[str(name)][:, columns]).ravel() for name in grid.columns]
        stiffness = np.array(sets).reshape(grid.shape[1], len(of_stiffness))  # there may be none
        x = np.hstack([np.repeat(pose, grid.shape[1], axis=0), np.tile(stiffness, (len(grid), 1))])
        # runs of one pose stay together in cross-validation
        groups = np.repeat(np.arange(len(grid)), grid.shape[1])
        names = (*of_pose, *of_stiffness)
        tree = regression_tree(x, grid.to_numpy(float).ravel(), names, self.seed, groups=groups)
        yield from _importance(tree, len(of_pose), grid.size)


def _importance(tree: Tree, n_pose: int, n: int) -> Iterator[dict[str, Any]]:
    done = tree.status == "done"
    for number, (name, share) in enumerate(zip(tree.names, tree.importance, strict=True)):
        yield {
            "predictor": name,
            "factor": "pose" if number < n_pose else "stiffness",
            "importance": float(share) if done else None,
            "leaves": tree.leaves if done else None,
            "r2": tree.r2_cross_validated,
            "n": n,
            "status": tree.status.value,
            "message": tree.message,
        }
