"""Figures and report of studies of kind range_of_motion."""

from spinepipe.report.range_of_motion.levels import levels_figure
from spinepipe.report.range_of_motion.variance import variance_figure

__all__ = ["levels_figure", "variance_figure"]
