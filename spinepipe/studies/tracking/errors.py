"""Job: how far motions are from the truth, per person, trial, approach and level."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.measures import between_neighbours, sagittal_angles, turned_apart
from spinepipe.motion.skeleton import BODIES, JOINTS, PELVIS, Skeleton, body_poses
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.forms import STANCE
from spinepipe.studies.tracking.moved import Moved, kinds_of_trials, motions
from spinepipe.studies.tracking.persons import centres_of, skeleton_in
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables_of_studies import ERRORS
from spinepipe.studies.tracking.truth import Truth, truths
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import DEG_PER_RAD, MM_PER_M

SAGITTAL = slice(JOINTS.index("L4L5"), JOINTS.index("T7T8") + 1)
"""Joints whose sagittal angle counts (Wang et al. 2021)."""


@dataclass(frozen=True, eq=False)
class Bones:
    """A person's skeleton, and the centres (18, 3) m of its bodies in their frames."""

    skeleton: Skeleton
    centres: Array


@dataclass(frozen=True, eq=False)
class Off:
    """Errors of a measure.

    Attributes
    ----------
    measure : its name. levels : (L,) vertebrae or joints. size : (N, L) mm or deg.
    told : (N, L) whether the truth is known.
    """

    measure: str
    levels: tuple[str, ...]
    size: Array
    told: NDArray[np.bool_]


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``errors.parquet``; it is empty where no truth is known."""
    settings, cohort = study_of_kind(Tracking, root, study)
    known = list(truths(dict(cohort.further)))
    bones = {name: bones_of(cohort, name) for name in {truth.specimen for truth in known}}
    tracked = read_frames(tables)["tracked"]
    rows = list(error_rows(tracked, known, bones, kinds_of_trials(cohort)))
    write(from_rows(ERRORS, rows), output, provenance("errors", settings, cohort))


def bones_of(cohort: Cohort, specimen: str) -> Bones:
    """A person's skeleton and centres."""
    skeleton = skeleton_in(cohort, specimen, subject_of(cohort, specimen))
    return Bones(skeleton, centres_of(cohort, specimen, skeleton))


def error_rows(
    tracked: pd.DataFrame,
    known: list[Truth],
    bones: Mapping[str, Bones],
    kinds: Mapping[tuple[str, str], str],
) -> Iterator[dict[str, Any]]:
    """Rows by motion with a truth, measure and level."""
    by_trial = {(truth.specimen, truth.trial): truth for truth in known}
    for moved in motions(tracked):
        key = moved.specimen, moved.trial
        if key not in by_trial:
            continue
        for off in errors_of(moved, by_trial[key], bones[moved.specimen]):
            if off.measure == "joint_angle_deg" and kinds[key] == STANCE:
                continue
            yield from _rows(moved, off)


def errors_of(moved: Moved, truth: Truth, bones: Bones) -> Iterator[Off]:
    """Errors of a motion at the instants of its truth."""
    turns, places = body_poses(bones.skeleton, moved.at(truth.time_s))
    at = places + np.einsum("fbij,bj->fbi", turns, bones.centres)
    apart = MM_PER_M * np.linalg.norm(at - truth.centres, axis=-1)
    above = slice(PELVIS + 1, None)
    yield Off("centre_mm", BODIES[above], apart[:, above], truth.known[:, above])
    both = truth.turned[:, :-1] & truth.turned[:, 1:]
    off = sagittal_angles(turns) - sagittal_angles(truth.turns)
    wrapped = np.abs((off + np.pi) % (2.0 * np.pi) - np.pi)
    names = JOINTS[SAGITTAL]
    yield Off("angle_deg", names, DEG_PER_RAD * wrapped[:, SAGITTAL], both[:, SAGITTAL])
    yield _joint_rotations(between_neighbours(turns), between_neighbours(truth.turns), both)


def _joint_rotations(ours: Array, true: Array, told: NDArray[np.bool_]) -> Off:
    """Angle between both changes of joint rotations (N, 17, 3, 3) since the first instant told."""
    size, later = np.zeros(told.shape), told.copy()
    for k in np.flatnonzero(told.any(axis=0)):
        first = int(np.argmax(told[:, k]))
        changes = [one[first, k].T @ one[:, k] for one in (ours, true)]
        size[:, k] = DEG_PER_RAD * turned_apart(*changes)
        later[first, k] = False
    return Off("joint_angle_deg", JOINTS, size, later)


def _rows(moved: Moved, off: Off) -> Iterator[dict[str, Any]]:
    for k, level in enumerate(off.levels):
        size = off.size[off.told[:, k], k]
        if not len(size):
            continue
        yield {
            "specimen": moved.specimen,
            "trial": moved.trial,
            "approach": moved.approach,
            "measure": off.measure,
            "level": level,
            "mean": float(size.mean()),
            "p95": float(np.percentile(size, 95.0)),
            "largest": float(size.max()),
            "n": len(size),
        }
