"""The best stiffness sets of a specimen, with which all its poses are simulated."""

from typing import Any

import pandas as pd

from spinepipe.marks import read_json
from spinepipe.studies.joint_pose_sensitivity.filters import judge_poses
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import STIFFNESS_COLUMNS


def ranked(settings: JointPoseSensitivity, calibrations: pd.DataFrame) -> list[dict[str, Any]]:
    """The sets of the reduced dataset of a specimen, least cost first.

    Each with its name, the pose it comes from, cost, and stiffness (J or 1, 6) SI.

    Parameters
    ----------
    calibrations : rows of the table, of this specimen alone.
    """
    judged = judge_poses(settings, calibrations)
    reduced = calibrations[calibrations["pose"].isin(judged.loc[judged["reduced"], "pose"])]
    costs = reduced.groupby("pose")["cost"].first().sort_values(kind="stable")
    return [
        {
            "name": f"best{rank:02d}",
            "pose": int(pose),
            "cost": float(costs[pose]),
            "stiffness": reduced.loc[reduced["pose"] == pose, list(STIFFNESS_COLUMNS)]
            .to_numpy(float)
            .tolist(),
        }
        for rank, pose in enumerate(costs.index, start=1)
    ]


def judging(settings: JointPoseSensitivity) -> str:
    """What decides which fits are ranked, as JSON."""
    return settings.success.model_dump_json()


def ranking(path: str) -> dict[str, list[dict[str, Any]]]:
    """Specimen to its best stiffness sets, from ``best.json``.

    Raises
    ------
    DamagedFile
        For a file that is not as it was written.
    """
    found: dict[str, list[dict[str, Any]]] = read_json(path)
    return found
