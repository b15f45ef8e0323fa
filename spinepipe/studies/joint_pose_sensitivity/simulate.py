"""Job: motion of one specimen, joint pose and stiffness set under all its tests."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle, MeasuredSpecimen
from spinepipe.effects.contract import Array
from spinepipe.files import Stamp, stamp
from spinepipe.frames import Pose
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics import Program, System, settle
from spinepipe.statics.many import Stack
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    sampled_poses,
    specimen_inputs,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.ranking import ranked_set, ranking
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import SIMULATIONS
from spinepipe.tables import read, to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS, STIFFNESS_COLUMNS, from_si
from spinepipe.world import Chain

TABLE = SIMULATIONS.without("specimen", "pose")
"""A job file: specimen and pose are in its folders' names."""

BLOCK = 25
"""Poses whose ranked sets are solved together."""

MOST_BLOCKS = 128
"""Whose ends a worker remembers, some 100 kB each."""


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
    if frames is None:
        ended, tested = _refused(inputs, no_frames), inputs.tested
    elif calibration:
        (ended,) = _solve_all(settings, cohort, inputs, [(frames, _calibrated(calibration))])
        tested = _in_frames(inputs, frames)
    else:
        width = 1 if settings.loading == "settle" else BLOCK  # runs in time take no stack
        first = int(pose) - int(pose) % width
        block = _ranked_ends(
            settings, root, specimen, range(first, first + width), stamp(poses), stamp(best)
        )
        ranked, tested = block[int(pose)]
        lacking = f"fewer fits in the reduced dataset than {stiffness} asks for"
        ended = ranked.get(stiffness) or _refused(inputs, lacking)
    rows = [
        {**row, "stiffness": stiffness, "joint": cohort.joint_names[row["joint"]]}
        for one, steps in zip(tested, ended, strict=True)
        for row in _case_rows(one, _zeroed(steps) if one.zeroed else steps)
    ]
    columns = {column.name: [row[column.name] for row in rows] for column in TABLE.columns}
    chosen = mark_of(calibration) if calibration else ranked_set(best, specimen, stiffness)
    made_by = provenance("simulate", settings, cohort, [specimen], [mark_of(poses), chosen])
    write(to_arrow(TABLE, columns), output, made_by)


def _calibrated(path: str) -> Array | str:
    """Stiffness (J or 1, 6) that was calibrated, or why there is none."""
    rows = read(path, [*STIFFNESS_COLUMNS, "message"])
    values = np.array([rows[name].to_numpy(zero_copy_only=False) for name in STIFFNESS_COLUMNS]).T
    if np.isfinite(values.astype(float)).all():
        return values
    return f"not calibrated: {rows['message'][0].as_py()}"


@lru_cache(maxsize=MOST_BLOCKS)
def _ranked_ends(
    settings: JointPoseSensitivity,
    root: str,
    specimen: str,
    block: range,
    poses: Stamp,
    best: Stamp,
) -> dict[int, tuple[dict[str, "_Ends"], tuple[MeasuredCycle, ...]]]:
    """How each ranked set of a specimen ends in neighbouring poses, and what was measured there.

    Their jobs come in any order: together they cost little more than two or three of them alone.
    """
    _, cohort = study_and_cohort(root, settings.study)
    inputs = specimen_inputs(root, settings.study, specimen, cohort.digest)
    sets = {one["name"]: np.array(one["stiffness"]) for one in ranking(best[0]).get(specimen, [])}
    sampled = ((pose, sampled_poses(poses[0]).of(specimen, pose)[0]) for pose in block)
    placed = {pose: frames for pose, frames in sampled if frames is not None}
    asked = [(frames, values) for frames in placed.values() for values in sets.values()]
    ends = iter(_solve_all(settings, cohort, inputs, asked))
    return {
        pose: ({name: next(ends) for name in sets}, _in_frames(inputs, frames))
        for pose, frames in placed.items()
    }


def _in_frames(inputs: MeasuredSpecimen, frames: tuple[Pose, ...]) -> tuple[MeasuredCycle, ...]:
    return tuple(one.in_frames(inputs.frames, frames) for one in inputs.tested)


@dataclass(frozen=True)
class _Ended:
    """How a load step ended: pose (n,) or None, and what was left to go to equilibrium (n,)."""

    q: Array | None
    status: Status
    message: str
    remaining: Array | None = None


_Ends = list[list[_Ended]]
"""Of all steps of all cases."""


def _refused(inputs: MeasuredSpecimen, reason: str) -> _Ends:
    refused = _Ended(None, Status.REFUSED, reason)
    return [[refused] * len(case.steps) for case in inputs.cases]


def _solve_all(
    settings: JointPoseSensitivity,
    cohort: Cohort,
    inputs: MeasuredSpecimen,
    placed: Sequence[tuple[tuple[Pose, ...], Array | str]],
) -> list[_Ends]:
    """Ends of all steps of all cases in poses with a stiffness each; refused where it is none."""
    ends: list[_Ends | None] = []
    models: list[SpineModel] = []
    for frames, values in placed:
        try:
            if isinstance(values, str):
                raise RefusedModel(values)
            models.append(bushing_model(settings, cohort, inputs.specimen, frames, values))
            ends.append(None)
        except RefusedModel as error:
            ends.append(_refused(inputs, str(error)))
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
        _Ended(None if np.isnan(q[0]) else q, Status(status), messages.get(lane, ""))
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
            ended.append(_Ended(pose, end.status, end.message, end.remaining))
        ends.append(ended)
    return ends


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
