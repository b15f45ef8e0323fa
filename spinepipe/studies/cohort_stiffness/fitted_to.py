"""What fits of a cohort study are fitted to, and what that is called in files and tables."""

from collections.abc import Iterable, Sequence

from spinepipe.cohort import Cohort
from spinepipe.studies.cohort_stiffness import CohortStiffness
from spinepipe.units import COORDINATE_COLUMNS

ALL, ALL_BUT, NOTHING = "all", "all_but_", "nothing"
"""All load cases together; all but the one that follows; what the literature is fitted to."""

NOBODY = "nobody"
"""Who is left out of a pooled fit of all specimens."""

POOLED = "partially_pooled"
"""The representation that is fitted to all specimens at once."""


def tests_of(study: CohortStiffness, cohort: Cohort) -> tuple[str, ...]:
    """The study's tests: those chosen, else all that have a reading."""
    if study.tests:
        return study.tests
    assert cohort.motion is not None
    read = cohort.motion[list(COORDINATE_COLUMNS)].notna().any(axis=1)
    moved = set(cohort.motion.loc[read, "test"])
    return tuple(test for test in cohort.tests if test in moved)


def load_sets(study: CohortStiffness, tests: Sequence[str]) -> tuple[str, ...]:
    """Labels of what stiffness is fitted to: each test, all, and all but one."""
    several = len(tests) > 1
    held_out = several and study.cross_validation.load_cases
    return (
        *tests,
        *((ALL,) if several else ()),
        *((f"{ALL_BUT}{test}" for test in tests) if held_out and len(tests) > 2 else ()),
    )


def load_cases(labels: Iterable[str]) -> tuple[str, ...]:
    """Load cases that labels of ``fitted_to`` name, each once, in their order."""
    named = (str(label).removeprefix(ALL_BUT) for label in labels)
    return tuple(dict.fromkeys(name for name in named if name not in (ALL, NOTHING)))


def joint_label(labels: Iterable[str]) -> str:
    """What fits to all load cases are called: the one load case where there is no other.

    Parameters
    ----------
    labels : of ``fitted_to``, and names of tests, whether their fits have a result or not.
    """
    every = {str(label) for label in labels} - {NOTHING}
    (name, *others) = every or {ALL}
    return ALL if others or name.startswith(ALL_BUT) else name


def label_of_others(labels: Iterable[str], test: str) -> str | None:
    """What the fit to all load cases but this one is called, None where there is none.

    Of two load cases it is that to the other one.

    Parameters
    ----------
    labels : of ``fitted_to``, and names of tests, whether their fits have a result or not.
    """
    every = {str(label) for label in labels}
    if any(label.startswith(ALL_BUT) for label in every):
        return f"{ALL_BUT}{test}"
    others = [name for name in load_cases(every) if name != test]
    return others[0] if len(others) == 1 else None
