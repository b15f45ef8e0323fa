"""Accuracy of an instrument beside its repeatability: of each coordinate the larger counts.

Would catch an accuracy that is not read, counts for the wrong coordinate, or moves old results.
"""

from dataclasses import replace
from pathlib import Path

import pytest
from cohort_cases import write

from spinepipe import cohort as cohorts
from spinepipe.cohort.cohort import Accuracy, MeasurementSd
from spinepipe.cohort.supports import _read_as
from spinepipe.problems import InputError
from spinepipe.studies.cohort_stiffness.problem import _weights
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

SD = MeasurementSd(rotation_deg=0.1, translation_mm=0.2, force_n=3.0)


def read(folder: Path, text: str = "") -> cohorts.Cohort:
    write(folder)
    header = folder / "cohort.yaml"
    header.write_text(header.read_text() + text)
    return replace(cohorts.read(folder), measurement_sd=SD)


def test_the_larger_counts_and_a_coordinate_of_its_own_before_its_kind(tmp_path: Path) -> None:
    told = "accuracy: {rotation_deg: 0.05, translation_mm: 0.3, extension_deg: 0.4, right_mm: 0.1}"
    cohort = read(tmp_path / "small", f"{told}\n")
    expected = [0.3, 0.3, 0.2, 0.4, 0.1, 0.1]
    assert cohort.reading_sd() == pytest.approx(expected)
    stated = MeasurementSd(rotation_deg=0.3, translation_mm=0.01)
    assert cohort.reading_sd(stated) == pytest.approx([0.3, 0.3, 0.1, 0.4, 0.3, 0.3])
    keys = {"study": "s", "kind": "cohort_stiffness", "cohort": "small", "free": ["extension"]}
    weights = _weights(CohortStiffness.model_validate(keys), cohort)
    assert weights == pytest.approx([0, 0, 0, 0.4**-2, 0, 0])


def test_alone_it_tells_where_it_tells_all(tmp_path: Path) -> None:
    cohort = replace(read(tmp_path / "small"), measurement_sd=None)
    assert cohort.reading_sd() is None
    angles = replace(cohort, accuracy=Accuracy(rotation_deg=0.2))
    assert angles.reading_sd() is None
    both = replace(cohort, accuracy=Accuracy(rotation_deg=0.2, translation_mm=0.1))
    assert both.reading_sd() == pytest.approx([0.1] * 3 + [0.2] * 3)


def test_a_cohort_without_it_keeps_its_digest(tmp_path: Path) -> None:
    cohort = read(tmp_path / "small")
    names = cohort.specimen_names
    other = replace(cohort, accuracy=Accuracy(rotation_deg=0.2))
    assert other.digest_of(names) != cohort.digest_of(names)
    assert other.digest_of(names) == replace(other).digest_of(names)
    assert replace(other, accuracy=None).digest_of(names) == cohort.digest_of(names)


def test_a_load_of_a_rig_is_as_sure_as_its_cell(tmp_path: Path) -> None:
    cohort = replace(read(tmp_path / "small"), accuracy=Accuracy(force_n=6.0, translation_mm=0.9))
    told = _read_as(cohort)
    assert told[0] == pytest.approx(0.9e-3 / 6.0)
    assert told[3] is None  # no SD of a moment
    assert _read_as(replace(cohort, accuracy=None))[0] == pytest.approx(0.2e-3 / 3.0)


def test_it_is_asked_as_every_key(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path / "small", "accuracy: {rotation_deg: 0, flexion_deg: 1}\n")
    assert "accuracy.rotation_deg" in str(caught.value)
    assert "accuracy.flexion_deg" in str(caught.value)
