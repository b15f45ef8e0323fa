"""Trials of a cohort: their files and kinds, and which approaches a study tries on which.

The forms of files that no other kind reads are in `forms.yaml`.
"""

from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.documents.form import read_forms
from spinepipe.muscles.myo_sim import origin_of_myo_sim
from spinepipe.studies.recordings import MOVING, RECORDED, STANCE, TRIALS, motion_digests
from spinepipe.studies.tracking.settings import LEARNT, OWN, Approach, Tracking

AXIS = {kind: axis for axis, kind in enumerate(MOVING)}
"""Rotation that a kind of motion is about, among extension, right bending and left rotation."""

OWN_FORMS = tuple(read_forms(Path(__file__).with_name("forms.yaml")).values())
MARKER_SET, PASSIVE, RATIOS, BOUNDS, CENTRES, TRUTH_CENTRES = OWN_FORMS
FORMS = (*RECORDED, *OWN_FORMS)

SMOOTH: Approach = "ik_smooth"
"""The approach that differs from inverse kinematics by time alone."""

BOTH = ("flexion_extension", "lateral_bending")
"""Kinds of trials that one calibration is made of."""

_CALIBRATED_ON: dict[str, str] = {kind: name for name, kind in LEARNT.items() if kind != "both"}
"""Name of the calibration on trials of a kind alone, where it has one of its own."""


def digests_of_lifts(cohort: Cohort) -> list[str]:
    """What net moments hang on besides tables: files of motion, and the trunk given to persons."""
    found = [one for name in cohort.specimen_names for one in motion_digests(cohort, name)]
    return [*found, origin_of_myo_sim().sha256]


def kinds_of_trials(cohort: Cohort) -> dict[tuple[str, str], str]:
    """Kind of motion by specimen and trial."""
    rows = cohort.further[TRIALS.stem]
    named = zip(rows["specimen"], rows["trial"], rows["kind"], strict=True)
    return {(str(who), str(trial)): str(kind) for who, trial, kind in named}


def kinds_of(cohort: Cohort, specimen: str) -> dict[str, str]:
    """Kind of each trial of a person, by its name."""
    every = kinds_of_trials(cohort).items()
    return {trial: kind for (who, trial), kind in every if who == specimen}


def source_kinds(law: str) -> tuple[str, ...]:
    """Kinds of the trials of which passive elements are: `axial_rotation` has its own name."""
    kind = LEARNT.get(law, law)
    return BOTH if kind == "both" else (kind,)


def trials_of_law(cohort: Cohort, specimen: str, law: str) -> tuple[str, ...]:
    """Names of the trials of which passive elements are."""
    wanted = source_kinds(law)
    return tuple(name for name, kind in kinds_of(cohort, specimen).items() if kind in wanted)


def calibration_of(cohort: Cohort, specimen: str, trial: str, approach: str) -> str | None:
    """Name of the calibration that an approach takes over; None where it takes none."""
    if approach == OWN:
        kind = kinds_of(cohort, specimen)[trial]
        return _CALIBRATED_ON.get(kind, kind)
    return approach if approach in LEARNT else None


def approaches_on_trials(
    study: Tracking, cohort: Cohort, specimen: str
) -> tuple[tuple[str, Approach], ...]:
    """(trial, approach) of a person.

    One posture has no motion to calibrate on or to be smooth in; passive elements of a kind of
    motion that the person did not make cannot be taken over.
    """
    kinds = kinds_of(cohort, specimen)
    found = []
    for trial, kind in kinds.items():
        for approach in study.approaches:
            if kind == STANCE and approach in (OWN, SMOOTH):
                continue
            law = calibration_of(cohort, specimen, trial, approach)
            if law is None or set(source_kinds(law)) <= set(kinds.values()):
                found.append((trial, approach))
    return tuple(found)
