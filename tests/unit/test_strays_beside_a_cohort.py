"""What editors put beside a cohort while a study runs is not read by its jobs.

Catches an editor's leftovers that a job reads as data.
"""

from pathlib import Path

import numpy as np
import pytest
from chain_cases import STUDY, Chains

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

NAMES = (".#motion.csv", "motion.csv~", "#motion.csv#", "lost.csv")


@pytest.mark.parametrize("name", NAMES)
def test_a_link_to_nowhere_stops_no_job(name: str, tmp_path: Path) -> None:
    """An editor's lock is one; a file of somebody's own may be."""
    folder = Chains({"a": np.full((3, 3), 50.0)}).write(tmp_path).root / "config/cohorts/chains"
    before = study_of_kind(CohortStiffness, str(tmp_path), STUDY)
    (folder / name).symlink_to(tmp_path / "nowhere")
    after = study_of_kind(CohortStiffness, str(tmp_path), STUDY)
    assert after[1] is before[1]
