"""Job: motion of one specimen in joint poses with stiffness sets, under all its tests.

Pose has two senses here. A joint pose is a sampled set of joint frames: where the joints lie and
how their axes are turned. The pose at the end of a load step, ``q``, is how far the joints moved.
Stiffness is the one fitted in the joint pose itself (``calibrated``), or one of the sets with the
least cost in the reduced dataset of the specimen (``best01`` ...), taken to other joint poses too.
"""

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
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import COORDINATE_COLUMNS, STIFFNESS_COLUMNS, from_si
from spinepipe.world import Chain


def run(
    root: str,
    study: str,
    poses: str,
    calibrations: Sequence[str],
    specimen: str,
    parts: Mapping[str, Mapping[str, str]],
) -> None:
    """Write a file of rows for each joint pose and stiffness set that is asked for.

    Parameters
    ----------
    root, study : folder of the project, and name of the study.
    poses : file of the specimen's sampled joint frames. calibrations : files of all its fits.
    parts : file to be written, to its ``pose`` (number) and ``stiffness`` (``calibrated``,
        ``best01`` ...).
    """
    settings, cohort = study_and_cohort(root, study)
    inputs = specimen_inputs(root, study, specimen, cohort.digest)
    fits = pd.concat([read_frame(path) for path in calibrations])
    best = {one["name"]: np.array(one["stiffness"]) for one in rank_fits(settings, fits)}
    of_pose, sampled = fits.set_index("pose"), sampled_poses(poses)
    # of each file the joint frames and the stiffness, (1 or J, 6) N/m and N m/rad, or in the place
    # of either why there is none
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
    # the mark of a file: what it hangs on. The settings that decide which fits are ranked count for
    # the best sets alone (False), not for a pose's own stiffness (True)
    rule = settings.success.model_dump_json()
    made_by = {
        own: provenance("simulate", settings, cohort, [specimen], [*read, *rules])
        for own, rules in ((True, []), (False, [rule]))
    }
    ends = _solve_all(settings, cohort, inputs, asked)
    for (path, place), (frames, _), ended in zip(parts.items(), asked, ends, strict=True):
        tested = inputs.tested
        # measured motion as coordinates of the pose's joint frames, in which it is predicted
        if not isinstance(frames, str):
            tested = tuple(one.in_frames(inputs.frames, frames) for one in tested)
        of = {"specimen": specimen, "pose": int(place["pose"]), "stiffness": place["stiffness"]}
        rows = [
            {**row, "joint": cohort.joint_names[row["joint"]]}
            for one, steps in zip(tested, ended, strict=True)
            for row in _case_rows(one, steps)
        ]
        write(from_rows(SIMULATIONS, rows, **of), path, made_by[place["stiffness"] == "calibrated"])


@dataclass(frozen=True)
class _StepResult:
    """How a load step ended; n = 6 x joints, from below, m and rad.

    Attributes
    ----------
    q : (n,) coordinates of all joints, or None where there is no solution.
    remaining : (n,) coordinates at equilibrium less q, where motion was simulated in time; None
        where equilibrium was solved, or there is none.
    """

    q: Array | None
    status: Status
    message: str
    remaining: Array | None = None


_Ends = list[list[_StepResult]]
"""Of one model: for each case (a cycle of a test) the ends of its load steps, in their order."""


def _solve_all(
    settings: JointPoseSensitivity,
    cohort: Cohort,
    inputs: MeasuredSpecimen,
    placed: Sequence[tuple[tuple[Pose, ...] | str, Array | str]],
) -> list[_Ends]:
    """Ends of all load steps, for each pair of joint frames and stiffness.

    Where frames or stiffness are missing, or the model is refused, all steps are `REFUSED` with the
    reason.

    Parameters
    ----------
    placed : joint frames and stiffness, (6,) or (1 or J, 6) SI; a text says why there is none.
    """
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
    # pairs that have a model (None so far) get their ends in order: by motion in time, or as poses
    # of equilibrium
    if settings.loading == "settle":
        found = iter([_settle(settings, inputs, model) for model in models])
    else:
        found = iter(_balance(inputs, models))
    return [next(found) if one is None else one for one in ends]


def _balance(inputs: MeasuredSpecimen, models: Sequence[SpineModel]) -> list[_Ends]:
    """Equilibrium under each load step; all models are solved side by side, see `Stack`."""
    if not models:
        return []
    runs = [(number, case) for number in range(len(models)) for case in inputs.cases]
    stack = Stack.of(models, runs)
    found = stack.solve()
    messages = {**stack.warnings(found.q), **found.messages}
    # a lane is one load step of one case of one model
    each = zip(found.q.reshape(len(found.q), -1), found.status.tolist(), strict=True)
    ended = [
        _StepResult(None if np.isnan(q[0]) else q, Status(status), messages.get(lane, ""))
        for lane, (q, status) in enumerate(each)
    ]
    by_run = [ended[first:end] for first, end in pairwise(stack.first.tolist())]
    count = len(inputs.cases)
    return [by_run[first : first + count] for first in range(0, len(runs), count)]


def _settle(settings: JointPoseSensitivity, inputs: MeasuredSpecimen, model: SpineModel) -> _Ends:
    """Where the chain is ``settle_time_s`` after each load step.

    Each step begins anew: the chain is at rest in the neutral pose, and the load comes on at once
    and stays. The damped equations of motion are integrated, see `spinepipe.statics.transient`.
    """
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
    """One row per step and joint (by number from 0, the lowest) of a case; mm and deg.

    Errors are predicted less measured. What is left to go to equilibrium is the largest over all
    joints, and the same in all rows of a step.

    Parameters
    ----------
    one : measured motion, in the same joint frames as the predicted one.
    """
    case = one.case
    # coordinates less those of step 0, as the cohort's readings are
    if one.zeroed:
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
                # some coordinates measured, not all: see `MeasuredCycle.in_frames`
                "unmeasured_taken_as_zero": bool(known.any() and not known.all()),
                "remaining_mm": None if left is None else left[:, :3].max(),
                "remaining_deg": None if left is None else left[:, 3:].max(),
                "status": end.status.value,
                "message": end.message,
            }


def _six(prefix: str, values: Array) -> dict[str, float]:
    """Values (6,), mm and deg, as columns ``prefix_...``."""
    return {
        f"{prefix}_{name}": float(value)
        for name, value in zip(COORDINATE_COLUMNS, values, strict=True)
    }
