"""Specimens of a cohort as scenes: the neutral pose, then each test at its largest load."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, transform_of
from spinepipe.report.specimen import SpecimenView, view_of
from spinepipe.report.specimen_curves import main_coordinate
from spinepipe.report.viewer.meshes import Endplate, spine_meshes
from spinepipe.report.viewer.scene import Scene, SceneLoad, SceneStep, bodies_at, rotation_vector
from spinepipe.report.words import AXIS, after_number, case, fixed, number
from spinepipe.units import COORDINATE_UNITS, COORDINATES, MM_PER_M, from_si

MOST_SPECIMENS = 6
_MOST_JOINTS = 3
"""Joints whose motion is told one by one; of more, all together and the largest."""


def specimen_scenes(
    cohort: Cohort,
    with_loads: bool = True,
    tests: Sequence[str] | None = None,
    load_shift_mm: Sequence[float] = (0.0, 0.0, 0.0),
) -> list[Scene]:
    """The first specimens of a cohort; none where it does not tell where joints are.

    Parameters
    ----------
    with_loads : whether there are steps beside the neutral pose. tests : None for all.
    load_shift_mm : (3,) by which the study moves all load points: anterior, superior, right.
    """
    if not cohort.has_frames:
        return []
    shown = cohort.specimen_names[:MOST_SPECIMENS]
    views = [view_of(cohort, name, tests, load_shift_mm) for name in shown]
    return [specimen_scene(cohort, view, with_loads) for view in views]


def specimen_scene(cohort: Cohort, view: SpecimenView, with_loads: bool = True) -> Scene:
    """One specimen, see `specimen_scenes`."""
    joints = [Endplate(frame.origin * MM_PER_M, frame.rotation) for frame in view.frames]
    meshes = spine_meshes(cohort.vertebrae, joints, view.points)
    # a body's frame: at the middle of its mesh, with the axes of ground in the neutral pose
    ends = [(m.vertices.min(axis=0), m.vertices.max(axis=0)) for m in meshes]
    origins = np.mean(ends, axis=1)
    bodies = bodies_at(cohort.vertebrae, meshes, origins, np.tile(np.eye(3), (len(meshes), 1, 1)))
    neutral = np.column_stack([origins, np.zeros((len(bodies), 3))])
    steps = [SceneStep("Neutral", "Neutral pose.", neutral)]
    if with_loads:
        of_test: dict[str, list[MeasuredCycle]] = {}
        for one in view.tested:
            of_test.setdefault(one.case.test, []).append(one)
        for cycles in of_test.values():
            # the first cycle that was read at its largest load
            chosen = next((c for c in cycles if np.isfinite(c.readings[c.peak]).any()), cycles[0])
            steps.append(_loaded(cohort, view, chosen, neutral))
    return Scene(view.specimen, "Load", bodies, steps, _caption(cohort, steps))


def measured_poses(frames: Sequence[Pose], motion: Array, neutral: Array) -> Array:
    """(B, 6) poses of all bodies for the motion (J, 6) m and rad of the joints, NaN: not read.

    Components that were not read are taken as zero. A vertebra above a joint of which nothing was
    read is nowhere: NaN.

    Parameters
    ----------
    frames : of the joints in ground, neutral pose. neutral : (B, 6) poses, mm and deg.
    """
    found = np.full_like(neutral, np.nan)
    found[0] = neutral[0]
    moved = Pose(np.eye(3), np.zeros(3))
    for k, (frame, q) in enumerate(zip(frames, motion, strict=True), start=1):
        if not np.isfinite(q).any():
            break
        moved = moved @ frame @ transform_of(np.nan_to_num(q)) @ frame.inverse()
        found[k, :3] = moved.apply(neutral[k, :3] / MM_PER_M) * MM_PER_M
        found[k, 3:] = rotation_vector(moved.rotation)
    return found


def _loaded(cohort: Cohort, view: SpecimenView, cycle: MeasuredCycle, neutral: Array) -> SceneStep:
    """The largest load of a test, with the pose that was measured under it."""
    loads, sizes = [], []
    for wrench in cycle.case.steps[cycle.peak].wrenches:
        body = wrench.body + 1  # wrenches count moving bodies
        at = wrench.point * MM_PER_M - neutral[body, :3]
        if wrench.force.any():
            loads.append(SceneLoad("force", body, at, wrench.force))
            sizes.append(f"{number(float(np.linalg.norm(wrench.force)))} N")
        if wrench.moment.any():
            # files give a pure moment no point: it is drawn at the middle of its vertebra
            at = at if wrench.force.any() else np.zeros(3)
            loads.append(SceneLoad("moment", body, at, wrench.moment))
            sizes.append(f"{number(float(np.linalg.norm(wrench.moment)))} N m")
    label = " ".join([case(cycle.case.test), " and ".join(dict.fromkeys(sizes))]).strip()
    motion = cycle.readings[cycle.peak]
    if not np.isfinite(motion).any():
        return SceneStep(label, f"{label}. No motion was measured.", neutral, loads=loads)
    measured = measured_poses(view.frames, motion, neutral)
    says = f"{label}. {_motion_in_words(cohort, cycle, motion)}"
    return SceneStep(label, says, neutral, measured, loads)


def _motion_in_words(cohort: Cohort, cycle: MeasuredCycle, motion: Array) -> str:
    """What was measured of the test's main coordinate, by joint from above."""
    driven = main_coordinate(cycle)
    if driven is None:
        return "Measured pose dashed."
    unit = after_number(COORDINATE_UNITS[driven])
    values = from_si(motion)[:, COORDINATES.index(driven)]
    joints = [f"{upper}–{lower}" for lower, upper in pairwise(cohort.vertebrae)]
    read = [(j, v) for j, v in zip(joints, values, strict=True) if np.isfinite(v)]
    if not read:
        return "Measured pose dashed."
    name = AXIS[driven].lower()
    if len(read) <= _MOST_JOINTS:
        told = ", ".join(f"{joint} {fixed(v, 1)}{unit}" for joint, v in reversed(read))
        return f"Measured {name}: {told}."
    joint, most = max(read, key=lambda one: abs(one[1]))
    total = fixed(float(sum(v for _, v in read)), 1)
    return (
        f"Measured {name}: {total}{unit} in {len(read)} joints, most at {joint} "
        f"({fixed(most, 1)}{unit})."
    )


def _caption(cohort: Cohort, steps: Sequence[SceneStep]) -> str:
    if cohort.landmarks is not None:
        size = ", between the endplates that landmarks tell"
    elif len(cohort.joint_names) > 1:
        size = ", sized by how far joints are apart"
    else:
        size = " and of a usual lumbar size"
    parts = [f"Vertebrae in the neutral pose; their shape is schematic{size}."]
    if any(step.measured is not None for step in steps):
        parts.append(
            "Dashed: the measured pose under the largest load of a test; components of the motion "
            "that were not measured are drawn as zero."
        )
    if any(step.loads for step in steps):
        parts.append("Arrows: forces end at their point, moments turn about theirs.")
    n = len(cohort.specimen_names)
    if n > MOST_SPECIMENS:
        parts.append(f"The first {MOST_SPECIMENS} of {n} specimens.")
    return " ".join(parts)
