"""Job: motion of one specimen in joint poses with stiffness sets, under all its tests."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle, MeasuredSpecimen
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics import Program, System, settle
from spinepipe.statics.batched import Stack
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.filters import rank_fits
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    sampled_poses,
    specimen_inputs,
    study_and_cohort,
)
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
    calibrations: Sequence[str],
    specimen: str,
    parts: Mapping[str, Mapping[str, str]],
) -> None:
    """Write the rows of poses and stiffness sets, a file each; all are solved in one stack.

    Parameters
    ----------
    calibrations : files that hold those of the specimen.
    """
    settings, cohort = study_and_cohort(root, study)
    inputs = specimen_inputs(root, study, specimen, cohort.digest)
    fits = pd.concat([read_frame(path) for path in calibrations])
    best = {one["name"]: np.array(one["stiffness"]) for one in rank_fits(settings, fits)}
    of_pose, sampled = fits.set_index("pose"), sampled_poses(poses)
    asked: list[tuple[tuple[Pose, ...] | str, Array | str]] = []
    values: Array | str
    for place in parts.values():
        placed, no_frames = sampled.of(specimen, int(place["pose"]))
        if place["stiffness"] == "calibrated":
            own = of_pose.loc[[int(place["pose"])]]
            values = own[list(STIFFNESS_COLUMNS)].to_numpy(float)
            if not np.isfinite(values).all():
                values = f"not calibrated: {own['message'].iloc[0]}"
        else:
            lacking = f"fewer fits in the reduced dataset than {place['stiffness']} asks for"
            values = best.get(place["stiffness"], lacking)
        asked.append((no_frames if placed is None else placed, values))
    read = [mark_of(path) for path in (poses, *calibrations)]
    rule = settings.success.model_dump_json()  # decides which fits are ranked
    made_by = {
        own: provenance("simulate", settings, cohort, [specimen], [*read, *rules])
        for own, rules in ((True, []), (False, [rule]))
    }
    ends = _solve_all(settings, cohort, inputs, asked)
    for (path, place), (frames, _), ended in zip(parts.items(), asked, ends, strict=True):
        tested = inputs.tested
        if not isinstance(frames, str):  # readings as seen in the frames of the pose
            tested = tuple(one.in_frames(inputs.frames, frames) for one in tested)
        rows = [
            {**row, "stiffness": place["stiffness"], "joint": cohort.joint_names[row["joint"]]}
            for one, steps in zip(tested, ended, strict=True)
            for row in _case_rows(one, steps)
        ]
        columns = {column.name: [row[column.name] for row in rows] for column in TABLE.columns}
        write(to_arrow(TABLE, columns), path, made_by[place["stiffness"] == "calibrated"])


@dataclass(frozen=True)
class _StepResult:
    """How a load step ended: pose (n,) or None, and what was left to go to equilibrium (n,)."""

    q: Array | None
    status: Status
    message: str
    remaining: Array | None = None


_Ends = list[list[_StepResult]]
"""Of all steps of all cases."""


def _solve_all(
    settings: JointPoseSensitivity,
    cohort: Cohort,
    inputs: MeasuredSpecimen,
    placed: Sequence[tuple[tuple[Pose, ...] | str, Array | str]],
) -> list[_Ends]:
    """Ends of all steps of all cases in poses with a stiffness each; refused where one is none."""
    ends: list[_Ends | None] = []
    models: list[SpineModel] = []
    for frames, values in placed:
        try:
            if isinstance(frames, str) or isinstance(values, str):
                raise RefusedModel(frames if isinstance(frames, str) else str(values))
            models.append(bushing_model(settings, cohort, inputs.specimen, frames, values))
            ends.append(None)
        except RefusedModel as error:
            refused = _StepResult(None, Status.REFUSED, str(error))
            ends.append([[refused] * len(case.steps) for case in inputs.cases])
    if settings.loading == "settle":
        found = iter([_settle(settings, inputs, model) for model in models])
    else:
        found = iter(_balance(inputs, models))
    return [next(found) if one is None else one for one in ends]


def _balance(inputs: MeasuredSpecimen, models: Sequence[SpineModel]) -> list[_Ends]:
    """Equilibrium under each load step, of all models in one stack."""
    if not models:
        return []
    runs = [(number, case) for number in range(len(models)) for case in inputs.cases]
    stack = Stack.of(models, runs)
    found = stack.solve()
    messages = {**stack.warnings(found.q), **found.messages}
    each = zip(found.q.reshape(len(found.q), -1), found.status.tolist(), strict=True)
    ended = [
        _StepResult(None if np.isnan(q[0]) else q, Status(status), messages.get(lane, ""))
        for lane, (q, status) in enumerate(each)
    ]
    by_run = [ended[first:end] for first, end in pairwise(stack.first.tolist())]
    count = len(inputs.cases)
    return [by_run[first : first + count] for first in range(0, len(runs), count)]


def _settle(settings: JointPoseSensitivity, inputs: MeasuredSpecimen, model: SpineModel) -> _Ends:
    """Where each load step, switched on in the neutral pose, has brought the chain in time."""
    chain, ends = Chain(model), []
    for case in inputs.cases:
        system, ended = System(chain, model, case), []
        for step in case.steps:
            program = Program.constant(system.slots.loading(step.wrenches))
            end = settle(system, program, settings.settle_time_s)
            pose = end.q if end.status.usable else None
            ended.append(_StepResult(pose, end.status, end.message, end.remaining))
        ends.append(ended)
    return ends


def _case_rows(one: MeasuredCycle, ended: list[_StepResult]) -> Iterator[dict[str, Any]]:
    """One row per step and joint (by number) of a case; mm and deg."""
    case = one.case
    if one.zeroed:  # poses less that of step 0, as the cohort's readings are
        first = ended[0]
        if first.q is None:
            why = f"step 0, which is subtracted, has no pose: {first.message}"
            lost = replace(first, message=why)
            ended = [lost if end.status.usable else end for end in ended]
        else:
            ended = [replace(end, q=None if end.q is None else end.q - first.q) for end in ended]
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
