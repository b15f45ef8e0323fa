"""Where joints are unloaded: in the neutral pose, or as the person stands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tracked_cohort import write

from spinepipe.cohort import read
from spinepipe.motion.points import marker_places
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking.approaches import objective_of, unloaded_posture
from spinepipe.studies.tracking.persons import TrackedPerson, person_of, skeleton_in_trial
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.trials import FORMS


def asked(unloaded_posture: str) -> Tracking:
    given = {"study": "s", "kind": "tracking", "cohort": "c", "unloaded_posture": unloaded_posture}
    return Tracking.model_validate(given)


def bent_where_they_stand(folder: Path) -> tuple[TrackedPerson, np.ndarray]:
    """A person whose stance has the joints L3L4 and L4L5 bent forwards by 4 deg each."""
    cohort = read(write(folder), (SUBJECTS, *FORMS))
    person = person_of(cohort, cohort.specimen_names[0], cohort.folder)
    q = np.zeros((1, 18, 6))
    q[:, 2:4, 3] = -np.deg2rad(4.0)
    trials = []
    for trial in person.trials:
        if trial.name == person.static:
            places = marker_places(skeleton_in_trial(person, trial), person.markers, q)
            whole = np.ones(places.shape[:2], dtype=bool)
            trial = replace(trial, time_s=trial.time_s[:1], places=places, seen=whole)
        trials.append(trial)
    return replace(person, trials=tuple(trials)), q[0, 1:]


def test_joints_are_unloaded_in_the_neutral_pose(tmp_path: Path) -> None:
    person, _ = bent_where_they_stand(tmp_path)
    law = objective_of(asked("neutral"), person, "optk_generic").passive
    assert law is not None
    np.testing.assert_array_equal(law.rest, np.zeros((17, 6)))


def test_joints_are_unloaded_as_the_person_stands(tmp_path: Path) -> None:
    """Springs share a bend out, so that the lumbar bend in all is what markers tell."""
    person, q = bent_where_they_stand(tmp_path)
    law = objective_of(asked("standing"), person, "optk_generic").passive
    assert law is not None
    lumbar = np.rad2deg(law.rest[:6, 3].sum())
    assert lumbar == pytest.approx(np.rad2deg(q[:6, 3].sum()), abs=2.0)
    np.testing.assert_allclose(law.forces(law.rest[None]), 0.0, atol=1e-12)


def test_without_a_static_trial_nobody_stands(tmp_path: Path) -> None:
    person, _ = bent_where_they_stand(tmp_path)
    with pytest.raises(ValueError, match="no static trial"):
        unloaded_posture(asked("standing"), replace(person, static=None))
