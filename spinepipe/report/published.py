"""What the papers found for the cohorts that were rebuilt from them."""

from collections.abc import Mapping
from typing import Any

from spinepipe.anatomy import published

PAPER_OF_COHORT = {"palanca_l1l4": "gould_2024a", "t12s1_phantom": "gould_2024b"}
"""Cohorts rebuilt from a paper, whose numbers are drawn beside ours."""

SHORT_NAME = {"gould_2024a": "Gould et al. 2024", "gould_2024b": "Gould et al. 2024b"}


def paper_of(cohort: str) -> tuple[str, Mapping[str, Any]] | None:
    """Short name and numbers of the paper a cohort was rebuilt from, or None."""
    name = PAPER_OF_COHORT.get(cohort)
    return None if name is None else (SHORT_NAME[name], published(name))
