"""What the papers found for the cohorts that were rebuilt from them."""

from collections.abc import Mapping
from typing import Any

from spinepipe.anatomy import published

PAPER_OF_COHORT = {"palanca_l1l4": "gould_2024a", "t12s1_phantom": "gould_2024b"}
"""Cohorts rebuilt from a paper, whose numbers are drawn beside ours."""

OF_JOINT_POSE, OF_COHORTS = "gould_2024a", "gould_2024b"
"""The paper that asked what studies of kind joint_pose_sensitivity ask, and cohort_stiffness."""

SHORT_NAME = {"gould_2024a": "Gould et al. 2024", "gould_2024b": "Gould et al. 2024b"}


def stands_for(cohort: str, paper: str) -> bool:
    """Whether a cohort was rebuilt from this paper: only then may results be held against it."""
    return PAPER_OF_COHORT.get(cohort) == paper


def paper_of(cohort: str, paper: str) -> tuple[str, Mapping[str, Any]] | None:
    """Short name and numbers of a paper for a cohort that was rebuilt from it, else None."""
    return (SHORT_NAME[paper], published(paper)) if stands_for(cohort, paper) else None
