"""Is the landmark that a factor moves there, and does a joint frame hang on it?"""

from collections.abc import Iterator, Sequence

from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.cohort.varied.change import Change
from spinepipe.cohort.varied.start import frame_landmarks, given_joints, moved_by
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.problems import Problem, did_you_mean, one_of
from spinepipe.studies.places import at

__all__ = ["check_landmark"]


def check_landmark(
    document: Document, key: str, change: Change, cohort: Cohort, specimens: Sequence[str]
) -> Iterator[Problem]:
    """Problems of one factor.

    Parameters
    ----------
    key : of the factor in the study file.
    specimens : of the cohort, those that the study has.
    """
    (vertebra,) = change.at
    if cohort.landmarks is None:
        found = f"a landmark in cohort '{cohort.name}', which has no landmarks.csv"
        allowed = "landmarks of a cohort that has them"
        remedy = "use joint_centre and joint_axes, or take another cohort"
        yield Problem(*at(document, key), found, allowed, remedy)
        return
    if vertebra not in cohort.vertebrae:
        known = cohort.vertebrae
        remedy = did_you_mean(vertebra, known, "correct its name")
        place = at(document, f"{key}.vertebra")
        yield Problem(*place, f"unknown vertebra '{vertebra}'", one_of(known), remedy)
    if change.landmark not in FRAME_LANDMARKS:
        yield _no_frame_landmark(document, key, change, cohort)
    elif vertebra in cohort.vertebrae:
        yield from _of_specimens(document, key, change, cohort, specimens)


def _no_frame_landmark(document: Document, key: str, change: Change, cohort: Cohort) -> Problem:
    """A landmark that makes no frame may be moved as far as one likes."""
    assert cohort.landmarks is not None
    there = change.landmark in set(cohort.landmarks["landmark"])
    why = "in no joint frame: it would do nothing" if there else "unknown"
    remedy = did_you_mean(
        change.landmark, FRAME_LANDMARKS, "correct its name, or delete the factor"
    )
    place = at(document, f"{key}.landmark")
    return Problem(*place, f"landmark '{change.landmark}', {why}", one_of(FRAME_LANDMARKS), remedy)


def _of_specimens(
    document: Document, key: str, change: Change, cohort: Cohort, specimens: Sequence[str]
) -> Iterator[Problem]:
    """Specimens without the landmark, then those in which nothing hangs on it."""
    vertebra = cohort.vertebrae.index(change.at[0])
    landmark = FRAME_LANDMARKS.index(change.landmark)
    without, idle = [], []
    for specimen in specimens:
        _, known = frame_landmarks(cohort, specimen)
        if not known[vertebra, landmark]:
            without.append(specimen)
        elif not moved_by(known, given_joints(cohort, specimen), vertebra, landmark):
            idle.append(specimen)
    what = f"{change.landmark} of {change.at[0]}"
    if without:
        found = f"{what}, which landmarks.csv does not have of {', '.join(without[:5])}"
        allowed = "a landmark of all chosen specimens"
        yield Problem(*at(document, f"{key}.landmark"), found, allowed, "delete the factor")
    if idle:
        found = f"{what}, on which no joint frame of {', '.join(idle[:5])} hangs"
        allowed = "a landmark of a frame that joints.csv does not give: it would do nothing"
        remedy = "delete the factor, or use joint_centre and joint_axes"
        yield Problem(*at(document, key), found, allowed, remedy)
