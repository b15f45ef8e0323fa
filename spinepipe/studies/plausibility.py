"""What is most likely wrong with a cohort: its files, and those that kinds of study read besides.

Each kind judges its own files (`Kind.doubts`), whatever study is asked for.
"""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import memoize_per_cohort
from spinepipe.muscles.subject import CM_PER_M
from spinepipe.plausibility.warnings.bodies import person
from spinepipe.plausibility.warnings.judge import of_cohort
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell
from spinepipe.problems import InputProblem
from spinepipe.studies.registry import every_kind, function_at
from spinepipe.studies.subjects import SUBJECTS


@memoize_per_cohort
def suspicions(cohort: Cohort) -> tuple[PlausibilityWarning, ...]:
    """All that looks wrong; kept, as warnings and refusals are asked one after the other."""
    found = list(of_cohort(cohort))
    for name, kind in every_kind().items():
        if kind.doubts is not None and any(form.stem in cohort.further for form in kind.forms):
            found += function_at(name, kind.doubts)(cohort)
    return tuple(dict.fromkeys(found))


def doubts(cohort: Cohort) -> tuple[InputProblem, ...]:
    """What is most likely wrong with a validated cohort, and no run is stopped by.

    That is all that cannot be certain, and what is but was meant.
    """
    return tuple(one.problem for one in suspicions(cohort) if not _refused(cohort, one))


def refusals(cohort: Cohort) -> tuple[InputProblem, ...]:
    """What cannot be right in a validated cohort, and is not said to be meant."""
    return tuple(one.with_switch for one in suspicions(cohort) if _refused(cohort, one))


def _refused(cohort: Cohort, one: PlausibilityWarning) -> bool:
    return one.certain and one.group not in cohort.acknowledged_warnings


def subject_doubts(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """What is most likely wrong with subjects that are sound: mass in lb, age in months."""
    rows = cohort.further.get(SUBJECTS.stem)
    for line, row in () if rows is None else rows.iterrows():
        height_m = float(row["height_cm"]) / CM_PER_M
        whose = (TableCell(SUBJECTS.stem, line, "height_cm"), str(row["specimen"]), CM_PER_M)
        yield from person(cohort, *whose, height_m, float(row["mass_kg"]), float(row["age_years"]))
