"""Jalalian et al. 2017, doi 10.1007/s11517-016-1576-8, and the cohorts made after its patients."""

COHORTS = ("ais18_phantom", "ais18_phantom_sd07", "ais18_phantom_sd19")
"""Made-up spines with the sex, age, Lenke class and Cobb angle of its Table 1."""


def reproduces(cohort: str) -> bool:
    """Whether a cohort was made after the paper's: only then are results set beside its numbers."""
    return cohort in COHORTS
