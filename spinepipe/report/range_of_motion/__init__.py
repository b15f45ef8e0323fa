"""Figures and report of studies of kind range_of_motion."""

from spinepipe.studies.range_of_motion.figures import levels_figure, variance_figure

__all__ = ["levels_figure", "variance_figure"]
