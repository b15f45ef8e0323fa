"""What is most likely wrong with sound subjects, for every kind that asks for them.

Apart from `subjects`, so that rewording it recomputes no result.
"""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_persons import of_person
from spinepipe.muscles.subject import CM_PER_M
from spinepipe.studies.subjects import SUBJECTS


def subject_doubts(cohort: Cohort) -> Iterator[Doubt]:
    """What is most likely wrong with subjects that are sound: mass in lb, age in months."""
    rows = cohort.further.get(SUBJECTS.stem)
    file = f"{cohort.name}/{SUBJECTS.file}"
    for line, row in () if rows is None else rows.iterrows():
        height_m = float(row["height_cm"]) / CM_PER_M
        place = (file, int(str(line)), str(row["specimen"]), "height_cm", CM_PER_M)
        yield from of_person(*place, height_m, float(row["mass_kg"]), float(row["age_years"]))
