"""Ghezelbash et al. 2016, doi 10.1007/s10237-016-0792-3, and the cohort that has its volunteers."""

COHORTS = ("trunk_volunteers",)
"""Persons and tasks of its captions and of its Table 1."""


def reproduces(cohort: str) -> bool:
    """Whether a cohort has the paper's volunteers: only then are results set beside its numbers."""
    return cohort in COHORTS
