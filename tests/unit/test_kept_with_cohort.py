"""What is kept of a cohort goes with it: a worker that serves many studies holds no old tables.

Catches tables of an old cohort that a worker goes on using.
"""

import gc
import weakref
from pathlib import Path

import pytest
from straight_chains import TESTS, write_cohort

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import memoize_per_cohort
from spinepipe.cohort.specimen import bodies
from spinepipe.studies.cohort_stiffness.problem import specimen_tests
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_cohort(tmp_path / "chains")
    return tmp_path / "chains"


def test_an_answer_is_worked_out_once_for_each_cohort_and_question(folder: Path) -> None:
    asked: list[tuple[int, str]] = []

    @memoize_per_cohort
    def answer(cohort: Cohort, question: str) -> str:
        asked.append((id(cohort), question))
        return question.upper()

    one, other = cohorts.read(folder), cohorts.read(folder)
    for cohort in (one, other, one):
        assert [answer(cohort, word) for word in ("a", "b", "a")] == ["A", "B", "A"]
    assert asked == [(id(cohort), word) for cohort in (one, other) for word in ("a", "b")]


def test_nothing_that_is_kept_holds_a_cohort(folder: Path) -> None:
    study = CohortStiffness(study="small", kind="cohort_stiffness", cohort="chains")
    cohort = cohorts.read(folder)
    assert bodies(cohort, "a") is bodies(cohort, "a")
    assert {one.case.test for one in specimen_tests(study, cohort, "a").tested} == set(TESTS)
    seen = weakref.ref(cohort)
    del cohort
    gc.collect()
    assert seen() is None
