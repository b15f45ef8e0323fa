"""Figures and report of studies of kind cohort_stiffness."""

from spinepipe.studies.cohort_stiffness.figures.error_map import error_map_figure
from spinepipe.studies.cohort_stiffness.figures.held_out_error import held_out_error_figure
from spinepipe.studies.cohort_stiffness.figures.load_case_stiffness import (
    load_case_stiffness_figure,
)
from spinepipe.studies.cohort_stiffness.figures.stiffness_by_level import stiffness_by_level_figure

__all__ = [
    "error_map_figure",
    "held_out_error_figure",
    "load_case_stiffness_figure",
    "stiffness_by_level_figure",
]
