"""Which approaches a study tries on which trials, and which calibration each takes over."""

from spinepipe.cohort import Cohort
from spinepipe.studies.tracking.forms import STANCE
from spinepipe.studies.tracking.reload_motions import kinds_of_trials
from spinepipe.studies.tracking.settings import LEARNT, OWN, Approach, Tracking

SMOOTH: Approach = "ik_smooth"
"""The approach that differs from inverse kinematics by time alone."""

BOTH = ("flexion_extension", "lateral_bending")
"""Kinds of trials that one calibration is made of."""

_OF_KIND: dict[str, str] = {kind: name for name, kind in LEARNT.items() if kind != "both"}


def kinds_of(cohort: Cohort, specimen: str) -> dict[str, str]:
    """Kind of each trial of a person, by its name."""
    return {
        trial: kind for (who, trial), kind in kinds_of_trials(cohort).items() if who == specimen
    }


def sources(law: str) -> tuple[str, ...]:
    """Kinds of the trials of which passive elements are: `axial_rotation` has its own name."""
    kind = LEARNT.get(law, law)
    return BOTH if kind == "both" else (kind,)


def trials_of_law(cohort: Cohort, specimen: str, law: str) -> tuple[str, ...]:
    """Names of the trials of which passive elements are."""
    wanted = sources(law)
    return tuple(name for name, kind in kinds_of(cohort, specimen).items() if kind in wanted)


def calibrated_in(cohort: Cohort, specimen: str, trial: str, approach: str) -> str | None:
    """Name of the calibration that an approach takes over; None where it takes none."""
    if approach == OWN:
        kind = kinds_of(cohort, specimen)[trial]
        return _OF_KIND.get(kind, kind)
    return approach if approach in LEARNT else None


def tried(study: Tracking, cohort: Cohort, specimen: str) -> tuple[tuple[str, Approach], ...]:
    """(trial, approach) of a person.

    One posture has no motion to calibrate on or to be smooth in; passive elements of a kind of
    motion that the person did not make cannot be taken over.
    """
    return tuple(
        (trial, approach)
        for trial, kind in kinds_of(cohort, specimen).items()
        for approach in study.approaches
        if not (kind == STANCE and approach in (OWN, SMOOTH))
        and _is_there(cohort, specimen, trial, approach)
    )


def _is_there(cohort: Cohort, specimen: str, trial: str, approach: str) -> bool:
    law = calibrated_in(cohort, specimen, trial, approach)
    if law is None:
        return True
    return set(sources(law)) <= set(kinds_of(cohort, specimen).values())
