"""What is most likely wrong with sound subjects, for every kind that asks for them.

Apart from `subjects`, so that rewording it recomputes no result.
"""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.muscles.subject import CM_PER_M
from spinepipe.plausibility.warnings.bodies import person
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell
from spinepipe.studies.subjects import SUBJECTS


def subject_doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """What is most likely wrong with subjects that are sound: mass in lb, age in months."""
    rows = cohort.further.get(SUBJECTS.stem)
    for line, row in () if rows is None else rows.iterrows():
        height_m = float(row["height_cm"]) / CM_PER_M
        whose = (TableCell(SUBJECTS.stem, line, "height_cm"), str(row["specimen"]), CM_PER_M)
        yield from person(cohort, *whose, height_m, float(row["mass_kg"]), float(row["age_years"]))
