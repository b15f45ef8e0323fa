"""Persons and tasks that are sound cell by cell and most likely wrong."""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.plausibility.warnings.columns import beyond_ranges
from spinepipe.plausibility.warnings.warning import PlausibilityWarning
from spinepipe.studies.plausibility import subject_doubts


def doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Warnings about subjects and tasks."""
    yield from subject_doubts(cohort)
    yield from beyond_ranges(cohort, "abdominal_pressure", "muscle_stress", "trunk_rotation")
    yield from beyond_ranges(cohort, "hands_away", "push", "twist")
