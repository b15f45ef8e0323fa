"""Tests that a rig starts at zero beside tests that it does not.

Catches zero readings taken for measured, or the other way round.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohort_cases import Change, swap, text, write

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import Accuracy, MeasurementSd, sd_of_reading
from spinepipe.cohort.zeroing import common_zeroing
from spinepipe.problems import InputError, InputProblem

LOADS = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm
*,flexion,0,L2,0,0,0,0,0,0
*,flexion,1,L2,0,0,0,0,0,-2
*,extension,0,L2,0,0,0,0,0,0
*,extension,1,L2,0,0,0,0,0,2
"""

MOTION = """\
specimen,test,cycle,step,joint,extension_deg,anterior_mm
a,flexion,1,0,L3L4,0,0
a,flexion,1,1,L3L4,-3,-0.5
a,extension,1,0,L3L4,1.5,0.2
a,extension,1,1,L3L4,4.5,0.6
b,extension,1,0,L3L4,-1,
b,extension,1,1,L3L4,1,
"""

ROWS: tuple[Change, ...] = (text("loads.csv", LOADS), text("motion.csv", MOTION))


def zeroed(value: str) -> Change:
    return swap("cohort.yaml", "zeroed_at_step_0: false", f"zeroed_at_step_0: {value}")


def read(folder: Path, *changes: Change) -> Cohort:
    return cohorts.read(write(folder / "small", *ROWS, *changes))


def refused(folder: Path, *changes: Change) -> tuple[InputProblem, ...]:
    with pytest.raises(InputError) as caught:
        read(folder, *changes)
    return caught.value.problems


def told(cohort: Cohort, column: str) -> list[float]:
    assert cohort.motion is not None
    return list(cohort.motion[column])


def test_a_test_that_is_not_named_is_zeroed_as_it_is_read(tmp_path: Path) -> None:
    found = read(tmp_path, zeroed("[flexion]"))
    assert found.zeroed_at_step_0 is True
    assert told(found, "extension_deg") == pytest.approx([0.0, -3.0, 0.0, 3.0, 0.0, 2.0])
    assert told(found, "anterior_mm")[:4] == pytest.approx([0.0, -0.5, 0.0, 0.4])
    assert np.isnan(told(found, "anterior_mm")[4:]).all()


@pytest.mark.parametrize(
    ("value", "alike"),
    [("[flexion, extension]", True), ("true", True), ("[]", False), ("false", False)],
)
def test_readings_stay_where_all_tests_are_alike(tmp_path: Path, value: str, alike: bool) -> None:
    found = read(tmp_path, zeroed(value))
    assert found.zeroed_at_step_0 is alike
    assert told(found, "extension_deg") == [0.0, -3.0, 1.5, 4.5, -1.0, 1.0]


def test_each_cycle_counts_from_its_own_start() -> None:
    rows = {"specimen": "a", "test": "x", "joint": "L3L4", "step": [0, 1, 0, 1]}
    blank = dict.fromkeys(cohorts.columns.TABLES["motion"].names[5:], np.nan)
    motion = pd.DataFrame(rows | blank | {"cycle": [1, 1, 2, 2], "extension_deg": [1.0, 3, 2, 7]})
    found, together = common_zeroing(motion, ["another"])
    assert found is not None
    assert (found["extension_deg"].tolist(), together) == ([1.0, 3.0, 2.0, 7.0], False)
    other = pd.concat([motion, motion.assign(test="another")], ignore_index=True)
    found, together = common_zeroing(other, ["another"])
    assert found is not None
    assert (found["extension_deg"].tolist(), together) == ([0.0, 2, 0, 5, 1, 3, 2, 7], True)


def test_a_test_that_has_no_start_must_be_named(tmp_path: Path) -> None:
    loaded_only = text("motion.csv", MOTION.replace("L3L4,1.5,0.2", "L3L4,1.5,"))
    (problem,) = refused(tmp_path, loaded_only, zeroed("[flexion]"))
    assert (problem.file, problem.row, problem.column) == ("small/motion.csv", 5, "anterior_mm")
    assert "none at step 0" in problem.found
    assert "name the test in zeroed_at_step_0" in problem.remedy


def test_a_name_that_is_no_test_is_told(tmp_path: Path) -> None:
    (problem,) = refused(tmp_path, zeroed("[flexoin, extension]"))
    assert (problem.file, problem.column) == ("small/cohort.yaml", "zeroed_at_step_0")
    assert problem.found == "'flexoin'"
    assert "flexion" in problem.remedy


def test_a_number_is_no_list_of_tests(tmp_path: Path) -> None:
    (problem,) = refused(tmp_path, zeroed("3"))
    assert problem.column == "zeroed_at_step_0"
    assert problem.allowed == "true, false, or a list of tests"


@pytest.mark.parametrize(
    ("sd", "accuracy", "first"),
    [(0.01, None, [0.0, 2.0]), (0.003, None, [0.015, 2.015]), (0.003, 0.1, [0.0, 2.0])],
)
def test_what_a_mean_of_readings_leaves_is_subtracted(
    sd: float, accuracy: float | None, first: list[float]
) -> None:
    """0.015 deg is within 4 SD of one reading or not; then it is left for the checks to refuse."""
    rows = {"specimen": "a", "test": "x", "joint": "L3L4", "step": [0, 1], "cycle": 1}
    blank = dict.fromkeys(cohorts.columns.TABLES["motion"].names[5:], np.nan)
    motion = pd.DataFrame(rows | blank | {"extension_deg": [0.015, 2.015]})
    stated = MeasurementSd(rotation_deg=sd, translation_mm=1.0)
    declared = sd_of_reading(stated, Accuracy(rotation_deg=accuracy))
    found, together = common_zeroing(motion, True, declared)
    assert found is not None
    assert together is True
    assert found["extension_deg"].tolist() == pytest.approx(first)
    alone, _ = common_zeroing(motion, True)
    assert alone is not None
    assert alone["extension_deg"].tolist() == [0.015, 2.015]
