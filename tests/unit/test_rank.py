"""How many unknowns the data tell: counted by hand on a bar of one joint.

Catches unknowns called known that the data leave open.
"""

import numpy as np
import pytest
from study_cases import STUDY, Size, project

from spinepipe.calibration.uncertainty import rank_at_start
from spinepipe.studies.free import loaded_and_measured
from spinepipe.studies.joint_pose_sensitivity.inputs import specimen_inputs, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem
from spinepipe.units import to_si


@pytest.mark.parametrize(
    ("free", "noise_deg", "rank", "silent"),
    [
        (("superior", "extension"), 0.01, 2, ()),
        (("superior", "extension", "left_rotation"), 0.01, 2, ("left_rotation",)),
        (("superior", "extension"), 30.0, 1, ("extension",)),
        (("superior", "extension"), None, 2, ()),
    ],
)
def test_rank(
    tmp_path, free: tuple[str, ...], noise_deg: float | None, rank: int, silent: tuple[str, ...]
) -> None:
    """Compressed and flexed by 1.5 deg: nothing turns it, and an SD of 30 deg hides flexion."""
    root = str(project(tmp_path, Size(n_joints=1, free=free)))
    study, cohort = study_and_cohort(root, STUDY)
    frames = specimen_inputs(root, STUDY, "a", cohort.digest).frames
    problem = calibration_problem(root, study, "a", frames)
    noise = None if noise_deg is None else to_si(np.repeat([0.001, noise_deg], 3))
    found = rank_at_start(problem, noise, 1.0)
    assert found.rank == rank
    assert tuple(name for name, is_one in zip(free, found.silent, strict=True) if is_one) == silent


def test_loaded_and_measured(tmp_path) -> None:
    """Compression and a moment about z; superior translation and extension were read."""
    _, cohort = study_and_cohort(str(project(tmp_path, Size())), STUDY)
    assert loaded_and_measured(cohort, cohort.tests) == ("superior", "extension")
    assert loaded_and_measured(cohort, ()) == ()
