"""From a cohort to persons: skeleton, markers, trials, and what the study takes for their joints.

Bodies are slices of the trunk, without head and arms; `carrying` hangs those on T1 as a trial has
them. Where `bodies.csv` tells nothing of a body, its mass is that of Pearsall's slices (pelvis: de
Leva's lower trunk), where it tells no inertia, that of an elliptic cylinder of the mass. A cohort
without `bodies.csv` says `gravity: false`, which here is about the file alone: persons have weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.anatomy.segments import MASS_PERCENT
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.motion import bounds as ranges
from spinepipe.motion import passive_elements as laws
from spinepipe.motion import ratios
from spinepipe.motion.bounds import Bounds
from spinepipe.motion.head_and_arms import ARMS, hung
from spinepipe.motion.passive_elements import PassiveElements
from spinepipe.motion.ratios import RatioSet
from spinepipe.motion.reading import DEFAULT_AXES, NoFrameError, read_motion
from spinepipe.motion.recorded import Recorded
from spinepipe.motion.scaling import by_body, scaled
from spinepipe.motion.skeleton import (
    BODIES,
    PELVIS,
    MarkerSet,
    MarkerTrial,
    Masses,
    Skeleton,
    skeleton_of,
)
from spinepipe.motion.slices import slice_inertias
from spinepipe.muscles.masses import ahead_cm, slice_percents
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.forms import BOUNDS, PASSIVE, RATIOS, STANCE, TRIALS
from spinepipe.studies.tracking.scaled_persons import ScaledPerson, sized_by
from spinepipe.studies.tracking.settings import Scaling
from spinepipe.units import MM_PER_M

PELVIS_BELOW_M = 0.05
"""How far its centre is below L5S1 at the reference height: a choice. Nobody is asked for what
moves the pelvis, so that it changes no result."""

_POINT = ["x_mm", "y_mm", "z_mm"]
_COM = [f"com_{name}" for name in _POINT]
_INERTIA = [f"i{axes}_kg_m2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]


Row = Mapping[Any, Any]
"""Cells of a row by their columns."""


@dataclass(frozen=True, eq=False)
class TrackedPerson:
    """Who was tracked.

    Attributes
    ----------
    name : of the specimen. subject : sex, age, height and mass.
    skeleton : slices of the trunk, without head and arms. markers : of the person's set.
    trials : in the order of the file, markers in the order of the set.
    passive, limits : what comes along, the cohort's own rows in place.
    centres : (18, 3) m, the point of each body that counts as its centre, in its frame.
    static : name of the trial that tells how the person stands; None without one.
    """

    name: str
    subject: Subject
    skeleton: Skeleton
    markers: MarkerSet
    trials: tuple[MarkerTrial, ...]
    passive: PassiveElements
    limits: Bounds
    centres: Array
    static: str | None


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
    told = _as_told(cohort, specimen, folder)
    fit = size_of(told).fit if scaling == "markers" else None
    return told if fit is None else as_large(told, fit.factors)


def size_of(person: TrackedPerson) -> ScaledPerson:
    """How large a person is beside the skeleton, by the static trial."""
    trial = next((trial for trial in person.trials if trial.name == person.static), None)
    return sized_by(person.skeleton, person.markers, trial)


def as_large(person: TrackedPerson, factors: Array) -> TrackedPerson:
    """A person, parts (3,) of the skeleton so many times as large; what bodies weigh stays."""
    kg = float(person.skeleton.masses.kg.sum())
    skeleton, markers = scaled(person.skeleton, person.markers, factors, kg)
    centres = by_body(factors)[:, None] * person.centres
    return replace(person, skeleton=skeleton, markers=markers, centres=centres)


def _as_told(cohort: Cohort, specimen: str, folder: Path) -> TrackedPerson:
    """The same as large as the cohort has it."""
    subject = subject_of(cohort, specimen)
    skeleton = skeleton_in(cohort, specimen, subject)
    markers = marker_set(cohort, specimen)
    return TrackedPerson(
        specimen,
        subject,
        skeleton,
        markers,
        tuple(
            trial_of(row, markers, recording(row, cohort.name, folder))
            for row in trial_rows(cohort, specimen)
        ),
        laws.passive_elements(cohort.further.get(PASSIVE.stem), f"{cohort.name}/{PASSIVE.file}"),
        ranges.bounds(cohort.further.get(BOUNDS.stem)),
        centres_of(cohort, specimen, skeleton),
        static_trial(cohort, specimen),
    )


def carrying(person: TrackedPerson, trial: MarkerTrial) -> Skeleton:
    """The skeleton, head and arms hung on T1 where the trial has them."""
    arms = next(name for name in ARMS if name == trial.arms)
    return Skeleton(person.skeleton.steps, hung(person.skeleton, arms, person.subject))


def ratio_sets(cohort: Cohort) -> Mapping[str, RatioSet]:
    """Sets of ratios that come along, and the cohort's own."""
    return ratios.ratio_sets(cohort.further.get(RATIOS.stem), f"{cohort.name}/{RATIOS.file}")


def of_specimen(table: pd.DataFrame, specimen: str) -> pd.DataFrame:
    """The rows of a specimen."""
    return table[table["specimen"] == specimen]


def trial_rows(cohort: Cohort, specimen: str) -> tuple[Row, ...]:
    """Rows of `trials.csv`, with the line of each as `line`."""
    rows = of_specimen(cohort.further["trials"], specimen)
    return tuple(rows.assign(line=rows.index).to_dict("records"))


def motion_files(cohort: Cohort, specimen: str) -> tuple[Path, ...]:
    """Files of motion of a person, each once: what a job of the person reads besides tables."""
    names = of_specimen(cohort.further["trials"], specimen)["file"]
    return tuple(cohort.folder / name for name in dict.fromkeys(names))


def static_trial(cohort: Cohort, specimen: str) -> str | None:
    """Name of the trial that tells the size: the one marked static, else the first stance."""
    rows = of_specimen(cohort.further["trials"], specimen)
    for chosen in (rows["static"] == "yes", rows["kind"] == STANCE):
        if chosen.any():
            return str(rows["trial"][chosen].iloc[0])
    return None


def recording(row: Row, cohort: str, folder: Path) -> Recorded:
    """The motion that a row of `trials.csv` names, all markers of the file.

    Raises
    ------
    InputError
        Of a file that cannot be read, or a row that leaves no frame of it.
    ValueError
        Of axes that are none.
    """
    name, axes = str(row["file"]), row["axes"]
    start, end = (float(str(row[key])) for key in ("start_s", "end_s"))
    text = axes if isinstance(axes, str) else DEFAULT_AXES
    try:
        return read_motion(folder / name, text, start, end, f"{cohort}/{name}")
    except NoFrameError as error:
        (problem,) = error.problems
        found = f"{problem.found} in {name}"
        at = (f"{cohort}/{TRIALS.file}", row["line"], "start_s" if error.late else "end_s")
        raise InputError([InputProblem(*at, found, problem.allowed, problem.remedy)]) from error


def trial_of(row: Row, markers: MarkerSet, recorded: Recorded) -> MarkerTrial:
    """The trial of a row; markers of the set that the file lacks are never seen."""
    n = len(recorded.time_s)
    places, seen = np.zeros((n, len(markers), 3)), np.zeros((n, len(markers)), dtype=bool)
    for k, name in enumerate(markers.names):
        if name in recorded.names:
            there = recorded.names.index(name)
            places[:, k], seen[:, k] = recorded.places[:, there], recorded.seen[:, there]
    name, kind, arms = (str(row[key]) for key in ("trial", "kind", "arms"))
    return MarkerTrial(name, kind, recorded.time_s, places, seen, arms)


def marker_set(cohort: Cohort, specimen: str) -> MarkerSet:
    """Markers of a person, in the order of the file."""
    rows = of_specimen(cohort.further["marker_set"], specimen)
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
    kg, com = _usual(frames, subject)
    about = np.full((len(BODIES), 3, 3), np.nan)
    if cohort.bodies is not None:
        for row in of_specimen(cohort.bodies, specimen).to_dict("records"):
            k = BODIES.index(row["vertebra"])
            turn = frames[k].rotation
            kg[k] = row["mass_kg"]
            com[k] = turn.T @ (_numbers(row, _COM) / MM_PER_M - frames[k].origin)
            about[k] = turn.T @ _symmetric(_numbers(row, _INERTIA)) @ turn
    steps = skeleton_of(joints, Masses(kg.copy(), com.copy(), np.zeros_like(about))).steps
    told = np.isfinite(about).all(axis=(1, 2))[:, None, None]
    if not told.all():
        about = np.where(told, about, slice_inertias(steps, kg, subject))
    return Skeleton(steps, Masses(kg, com, about))


def _numbers(row: Row, names: list[str]) -> Array:
    return np.array([row[name] for name in names], dtype=float)


def _symmetric(six: Array) -> Array:
    """(3, 3) of xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _usual(frames: tuple[Pose, ...], subject: Subject) -> tuple[Array, Array]:
    """Masses (18,) and centres (18, 3) m in bodies, where a cohort tells none."""
    tall = subject.height_m / REFERENCE.height_m
    percents = (MASS_PERCENT[f"lower_trunk {subject.sex}"], *reversed(slice_percents()))
    com = half_way(tuple(frame.origin for frame in frames[1:]))
    com[PELVIS] = frames[PELVIS].origin - [0.0, tall * PELVIS_BELOW_M, 0.0]
    com[1:, 0] += tall * np.array(ahead_cm()[::-1]) / 100.0
    own = [frame.rotation.T @ (at - frame.origin) for frame, at in zip(frames, com, strict=True)]
    return np.array(percents) / 100.0 * subject.mass_kg, np.array(own)


def half_way(joints: tuple[Array, ...]) -> Array:
    """(18, 3) m in ground: half way from each body's joint below to that above.

    T1, above which no joint is told, is as high as T2; the pelvis' own is L5S1.
    """
    above = (*joints[1:], 2.0 * joints[-1] - joints[-2])
    middles = [(low + high) / 2.0 for low, high in zip(joints, above, strict=True)]
    return np.array([joints[0], *middles])


def centres_of(cohort: Cohort, specimen: str, skeleton: Skeleton) -> Array:
    """(18, 3) m in body frames, from `centres.csv`, else half way to the joint above."""
    steps = skeleton.steps
    found = np.zeros((len(BODIES), 3))
    found[1:-1] = [step.origin / 2.0 for step in steps[1:]]
    found[-1] = steps[-1].rotation.T @ found[-2]
    table = cohort.further.get("centres")
    if table is not None:
        rows = of_specimen(table, specimen)
        places = [BODIES.index(name) for name in rows["vertebra"]]
        found[places] = rows[_POINT].to_numpy(float) / MM_PER_M
    return found
