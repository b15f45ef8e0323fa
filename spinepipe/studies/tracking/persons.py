"""From a cohort to persons: skeleton, markers, trials, and what the study takes for their joints.

Bodies are slices of the trunk, without head and arms; `skeleton_in_trial` hangs those on T1. Where
`bodies.csv` tells nothing of a body, its mass is that of Pearsall's slices (pelvis: de Leva's lower
trunk), where it tells no inertia, that of an elliptic cylinder of the mass. A cohort without
`bodies.csv` says `gravity: false`, which here is about the file alone: persons have weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from spinepipe.anatomy.segments import MASS_PERCENT
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.motion.body_segments import ARMS, slice_inertias, with_head_and_arms
from spinepipe.motion.joint_tables import bounds, ratio_sets
from spinepipe.motion.passive import PassiveElements, passive_elements
from spinepipe.motion.scaling import ScalingFit, body_factors, fit_scaling, scale_skeleton
from spinepipe.motion.skeleton import (
    BODIES,
    PELVIS,
    MarkerSet,
    MarkerTrial,
    Masses,
    Skeleton,
    skeleton_of,
)
from spinepipe.muscles.masses import ahead_cm, slice_percents
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.studies.recordings import (
    of_specimen,
    read_recording,
    static_trial,
    trial_of,
    trial_rows,
)
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.settings import Scaling
from spinepipe.studies.tracking.tables import NO_STATIC, NOT_TOLD, TOLD
from spinepipe.studies.tracking.trials import BOUNDS, CENTRES, MARKER_SET, PASSIVE, RATIOS
from spinepipe.units import MM_PER_M

PELVIS_BELOW_M = 0.05
"""How far its centre is below L5S1 at the reference height: a choice. Nobody is asked for what
moves the pelvis, so that it changes no result."""

_POINT = ["x_mm", "y_mm", "z_mm"]
_COM = [f"com_{name}" for name in _POINT]
_INERTIA = [f"i{axes}_kg_m2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]

AS_IT_IS = "the cohort's skeleton is taken as it is"


@dataclass(frozen=True, eq=False)
class TrackedPerson:
    """Who was tracked.

    Attributes
    ----------
    name : of the specimen. subject : sex, age, height and mass.
    skeleton : slices of the trunk, without head and arms. markers : of the person's set.
    trials : in the order of the file, markers in the order of the set.
    passive, limits : what comes along, the cohort's own rows in place; limits (17, 6, 2) m and rad.
    centres : (18, 3) m, the point of each body that counts as its centre, in its frame.
    static : name of the trial that tells how the person stands; None without one.
    """

    name: str
    subject: Subject
    skeleton: Skeleton
    markers: MarkerSet
    trials: tuple[MarkerTrial, ...]
    passive: PassiveElements
    limits: Array
    centres: Array
    static: str | None


@dataclass(frozen=True, eq=False)
class ScaledPerson:
    """What markers say of the size.

    Attributes
    ----------
    fit : factors and what they leave; None where markers do not tell the size, status and message
        say why.
    """

    fit: ScalingFit | None
    status: str
    message: str = ""


def person_of(
    cohort: Cohort, specimen: str, folder: Path, scaling: Scaling = "none"
) -> TrackedPerson:
    """A person and what was recorded.

    Parameters
    ----------
    folder : of the cohort, where the files of motion are.
    scaling : by markers, skeleton and markers are as large as the static trial says, and as the
        cohort has them where it does not say it.

    Raises
    ------
    InputError
        Of motion that cannot be read, and of joint tables that are unsound.
    """
    subject, markers = subject_of(cohort, specimen), marker_set(cohort, specimen)
    skeleton = skeleton_in(cohort, specimen, subject)
    person = TrackedPerson(
        specimen,
        subject,
        skeleton,
        markers,
        tuple(
            trial_of(row, markers, read_recording(row, cohort.name, folder))
            for row in trial_rows(cohort, specimen)
        ),
        passive_elements(cohort.further.get(PASSIVE.stem), f"{cohort.name}/{PASSIVE.file}"),
        bounds(cohort.further.get(BOUNDS.stem)),
        centres_of(cohort, specimen, skeleton),
        static_trial(cohort, specimen),
    )
    fit = size_of(person).fit if scaling == "markers" else None
    if fit is None:
        return person
    # parts of the skeleton as large as markers say; what bodies weigh together stays
    kg = float(skeleton.masses.kg.sum())
    skeleton, markers = scale_skeleton(skeleton, markers, fit.factors, kg)
    centres = body_factors(fit.factors)[:, None] * person.centres
    return replace(person, skeleton=skeleton, markers=markers, centres=centres)


def size_of(person: TrackedPerson) -> ScaledPerson:
    """How large a person is beside the skeleton, by the static trial."""
    static = next((trial for trial in person.trials if trial.name == person.static), None)
    if static is None:
        return ScaledPerson(None, NO_STATIC, f"no trial tells the size; {AS_IT_IS}")
    try:
        return ScaledPerson(fit_scaling(person.skeleton, person.markers, static), TOLD)
    except ValueError as why:
        return ScaledPerson(None, NOT_TOLD, f"{why}; {AS_IT_IS}")


def skeleton_in_trial(person: TrackedPerson, trial: MarkerTrial) -> Skeleton:
    """The skeleton, head and arms hung on T1 where the trial has them."""
    arms = next(name for name in ARMS if name == trial.arms)
    return Skeleton(
        person.skeleton.steps, with_head_and_arms(person.skeleton, arms, person.subject)
    )


def ratios_of(cohort: Cohort) -> Mapping[str, Array]:
    """Sets of ratios that come along, and the cohort's own."""
    return ratio_sets(cohort.further.get(RATIOS.stem), f"{cohort.name}/{RATIOS.file}")


def marker_set(cohort: Cohort, specimen: str) -> MarkerSet:
    """Markers of a person, in the order of the file."""
    rows = of_specimen(cohort.further[MARKER_SET.stem], specimen)
    return MarkerSet(
        tuple(rows["marker"]),
        np.array([BODIES.index(name) for name in rows["vertebra"]], dtype=np.int64),
        rows[_POINT].to_numpy(float) / MM_PER_M,
        rows["weight"].fillna(1.0).to_numpy(float),
        tuple(rows["cluster"].fillna("")),
    )


def skeleton_in(cohort: Cohort, specimen: str, subject: Subject) -> Skeleton:
    """Joints of the cohort, and bodies as slices of the trunk."""
    joints = joint_frames(cohort, specimen)
    frames = (Pose(np.eye(3), joints[0].origin), *joints)
    kg, com = _usual_masses(frames, subject)
    about = np.full((len(BODIES), 3, 3), np.nan)
    if cohort.bodies is not None:
        for row in of_specimen(cohort.bodies, specimen).to_dict("records"):
            k = BODIES.index(row["vertebra"])
            turn = frames[k].rotation
            kg[k] = row["mass_kg"]
            at = np.array([row[name] for name in _COM], dtype=float) / MM_PER_M
            com[k] = turn.T @ (at - frames[k].origin)
            xx, yy, zz, xy, xz, yz = (float(row[name]) for name in _INERTIA)
            whole = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            about[k] = turn.T @ whole @ turn
    # bodies.csv is in ground axes, seen from the body here; inertias that none tells are made up
    steps = skeleton_of(joints, Masses(kg.copy(), com.copy(), np.zeros_like(about))).steps
    told = np.isfinite(about).all(axis=(1, 2))[:, None, None]
    if not told.all():
        about = np.where(told, about, slice_inertias(steps, kg, subject))
    return Skeleton(steps, Masses(kg, com, about))


def _usual_masses(frames: tuple[Pose, ...], subject: Subject) -> tuple[Array, Array]:
    """Masses (18,) and centres (18, 3) m in bodies, where a cohort tells none."""
    tall = subject.height_m / REFERENCE.height_m
    percents = (MASS_PERCENT[f"lower_trunk {subject.sex}"], *reversed(slice_percents()))
    # half way from each body's joint below to that above; T1, above which no joint is told, is as
    # high as T2
    joints = [frame.origin for frame in frames[1:]]
    above = [*joints[1:], 2.0 * joints[-1] - joints[-2]]
    middles = [(low + high) / 2.0 for low, high in zip(joints, above, strict=True)]
    com = np.array([joints[0], *middles])
    com[PELVIS] = frames[PELVIS].origin - [0.0, tall * PELVIS_BELOW_M, 0.0]
    com[1:, 0] += tall * np.array(ahead_cm()[::-1]) / 100.0
    own = [frame.rotation.T @ (at - frame.origin) for frame, at in zip(frames, com, strict=True)]
    return np.array(percents) / 100.0 * subject.mass_kg, np.array(own)


def centres_of(cohort: Cohort, specimen: str, skeleton: Skeleton) -> Array:
    """(18, 3) m in body frames, from `centres.csv`, else half way to the joint above."""
    steps = skeleton.steps
    found = np.zeros((len(BODIES), 3))
    found[1:-1] = [step.origin / 2.0 for step in steps[1:]]
    found[-1] = steps[-1].rotation.T @ found[-2]
    table = cohort.further.get(CENTRES.stem)
    if table is not None:
        rows = of_specimen(table, specimen)
        places = [BODIES.index(name) for name in rows["vertebra"]]
        found[places] = rows[_POINT].to_numpy(float) / MM_PER_M
    return found
