"""Job: motion of one specimen, joint pose and stiffness set under all its tests."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spinepipe.cohort.measured import MeasuredCycle, MeasuredSpecimen
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics import Program, System, follow, settle
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    sampled_poses,
    specimen_inputs,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.ranking import ranked_set
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import SIMULATIONS
from spinepipe.tables import read_frame, to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, STIFFNESS_COLUMNS, from_si
from spinepipe.world import Chain

TABLE = SIMULATIONS.without("specimen", "pose")
"""A job file: specimen and pose are in its folders' names."""


def run(
    root: str,
    study: str,
    poses: str,
    calibration: str,
    best: str,
    specimen: str,
    pose: str,
    stiffness: str,
    output: str,
) -> None:
    """Write the rows of one specimen, pose and stiffness set."""
    settings, cohort = study_and_cohort(root, study)
    inputs = specimen_inputs(root, study, specimen, cohort.digest)
    frames, no_frames = sampled_poses(poses).of(specimen, int(pose))
    values, no_values = _stiffness(calibration, best, specimen, stiffness)
    model, reason = None, no_frames or no_values
    if frames is not None and values is not None:
        try:
            model = bushing_model(settings, cohort, specimen, frames, values)
        except RefusedModel as error:
            reason = str(error)
    ended = _solve_all(settings, inputs, model, reason)
    tested = [one.in_frames(inputs.frames, frames or inputs.frames) for one in inputs.tested]
    rows = [
        {**row, "stiffness": stiffness, "joint": cohort.joint_names[row["joint"]]}
        for one, steps in zip(tested, ended, strict=True)
        for row in _case_rows(one, _zeroed(steps) if one.zeroed else steps)
    ]
    columns = {column.name: [row[column.name] for row in rows] for column in TABLE.columns}
    given = [] if calibration else [ranked_set(best, specimen, stiffness)]
    made_by = provenance("simulate", settings, cohort, [specimen], given)
    write(to_arrow(TABLE, columns), output, made_by)


def _stiffness(calibration: str, best: str, specimen: str, name: str) -> tuple[Array | None, str]:
    """Stiffness (J or 1, 6) to simulate with, or None and the reason."""
    if calibration:
        rows = read_frame(calibration)
        values = rows[list(STIFFNESS_COLUMNS)].to_numpy(float)
        if np.isfinite(values).all():
            return values, ""
        return None, f"not calibrated: {rows['message'].iloc[0]}"
    ranked = ranked_set(best, specimen, name)
    if ranked:
        return np.array(json.loads(ranked)), ""
    return None, f"fewer fits in the reduced dataset than {name} asks for"


@dataclass(frozen=True)
class _Ended:
    """How a load step ended: pose (n,) or None, and what was left to go to equilibrium (n,)."""

    q: Array | None
    status: Status
    message: str
    remaining: Array | None = None


def _solve_all(
    settings: JointPoseSensitivity, inputs: MeasuredSpecimen, model: SpineModel | None, reason: str
) -> list[list[_Ended]]:
    """Ends of all steps of all cases; refused with the reason when there is no model."""
    if model is None:
        refused = _Ended(None, Status.REFUSED, reason)
        return [[refused] * len(case.steps) for case in inputs.cases]
    chain = Chain(model)
    solve = _settle if settings.loading == "settle" else _balance
    return [solve(settings, System(chain, model, case)) for case in inputs.cases]


def _balance(settings: JointPoseSensitivity, system: System) -> list[_Ended]:
    """Equilibrium under each load step."""
    ends = [step.equilibrium for step in follow(system)]
    return [_Ended(e.q if e.status.usable else None, e.status, e.message) for e in ends]


def _settle(settings: JointPoseSensitivity, system: System) -> list[_Ended]:
    """Where each load step, switched on in the neutral pose, has brought the chain in time."""
    ended = []
    for step in system.case.steps:
        program = Program.constant(system.slots.loading(step.wrenches))
        end = settle(system, program, settings.settle_time_s)
        pose = end.q if end.status.usable else None
        ended.append(_Ended(pose, end.status, end.message, end.remaining))
    return ended


def _zeroed(ended: list[_Ended]) -> list[_Ended]:
    """Poses less that of step 0, as the cohort's readings are; none where step 0 has none."""
    first = ended[0]
    if first.q is None:
        lost = replace(first, message=f"step 0, which is subtracted, has no pose: {first.message}")
        return [lost if end.status.usable else end for end in ended]
    return [replace(end, q=None if end.q is None else end.q - first.q) for end in ended]


def _case_rows(one: MeasuredCycle, ended: list[_Ended]) -> Iterator[dict[str, Any]]:
    """One row per step and joint (by number) of a case; mm and deg."""
    case = one.case
    for step, measured, end in zip(case.steps, from_si(one.measured), ended, strict=True):
        nowhere = np.full_like(measured, np.nan)
        predicted = nowhere if end.q is None else from_si(end.q.reshape(-1, 6))
        left = None if end.remaining is None else np.abs(from_si(end.remaining.reshape(-1, 6)))
        for joint, (there, seen) in enumerate(zip(predicted, measured, strict=True)):
            known = np.isfinite(seen)
            yield {
                "test": case.test,
                "cycle": case.cycle,
                "step": step.step,
                "joint": joint,
                **_six("predicted", there),
                **_six("measured", seen),
                **_six("error", there - seen),
                "unmeasured_taken_as_zero": bool(known.any() and not known.all()),
                "remaining_mm": None if left is None else left[:, :3].max(),
                "remaining_deg": None if left is None else left[:, 3:].max(),
                "status": end.status.value,
                "message": end.message,
            }


def _six(prefix: str, values: Array) -> dict[str, float]:
    return {
        f"{prefix}_{name}": float(value)
        for name, value in zip(COORDINATE_COLUMNS, values, strict=True)
    }
