"""Figures and report of studies of kind discrepancy."""

from collections.abc import Callable, Mapping

import pandas as pd
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.studies.discrepancy.figures.effects import (
    effect_confusions_figure,
    effect_evidence_figure,
)
from spinepipe.studies.discrepancy.figures.gap_held_out import gap_held_out_figure
from spinepipe.studies.discrepancy.figures.gap_map import gap_by_step_figure, gap_map_figure
from spinepipe.studies.discrepancy.verdict import Verdict, read_verdict

__all__ = ["DRAW", "read_verdict"]

Draw = Callable[[Cohort, Verdict, Mapping[str, pd.DataFrame]], Figure]

DRAW: dict[str, Draw] = {
    "gap_map": gap_map_figure,
    "gap_by_step": gap_by_step_figure,
    "effect_evidence": effect_evidence_figure,
    "gap_held_out": gap_held_out_figure,
    "effect_confusions": effect_confusions_figure,
}
"""What draws each figure; its tables are in ``DISCREPANCY_FIGURES`` of the layout."""
