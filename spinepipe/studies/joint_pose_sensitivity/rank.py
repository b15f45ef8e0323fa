"""Job: the best stiffness sets of each specimen, with which all its poses are simulated."""

import json
from typing import Any

import pandas as pd

from spinepipe.files import appearing
from spinepipe.jobs.digest import digest_of
from spinepipe.marks import with_mark
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import read_frame
from spinepipe.units import STIFFNESS_COLUMNS


def run(root: str, study: str, calibrations: str, success: str, output: str) -> None:
    """Write ``best.json``: specimen to its best sets of the reduced dataset; least cost is best."""
    settings, cohort = study_and_cohort(root, study)
    judged = read_frame(success)
    kept = judged.loc[judged["reduced"], ["specimen", "pose"]]
    frame = read_frame(calibrations).merge(kept, on=["specimen", "pose"])
    best = {
        specimen: _best(settings, frame[frame["specimen"] == specimen])
        for specimen in cohort.specimen_names
    }
    data = with_mark(best, digest_of("rank", settings, cohort))
    with appearing(output) as temporary:
        temporary.write_text(json.dumps(data, indent=1), encoding="utf-8")


def _best(settings: JointPoseSensitivity, frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The best sets of one specimen: pose they come from, cost, stiffness (J or 1, 6) SI."""
    costs = frame.groupby("pose")["cost"].first().sort_values(kind="stable")
    chosen = costs.index[: settings.best_models]
    return [
        {
            "name": f"best{rank:02d}",
            "pose": int(pose),
            "cost": float(costs[pose]),
            "stiffness": frame.loc[frame["pose"] == pose, list(STIFFNESS_COLUMNS)]
            .to_numpy(float)
            .tolist(),
        }
        for rank, pose in enumerate(chosen, start=1)
    ]
