"""Figures and report of studies of kind global_sensitivity."""

from collections.abc import Callable

from matplotlib.figure import Figure

from spinepipe.studies.global_sensitivity.figures.convergence import convergence_figure
from spinepipe.studies.global_sensitivity.figures.indices import indices_figure
from spinepipe.studies.global_sensitivity.figures.scatter import scatter_figure
from spinepipe.studies.global_sensitivity.page import sensitivity_page

__all__ = ["DRAW", "convergence_figure", "indices_figure", "scatter_figure", "sensitivity_page"]

DRAW: dict[str, Callable[..., Figure]] = {
    "factor_indices": indices_figure,
    "index_convergence": convergence_figure,
    "top_factors": scatter_figure,
}
"""What draws each figure, from the cohort and the frames of its tables."""
