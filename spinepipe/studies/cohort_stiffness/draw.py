"""Job: one figure of a cohort study, as SVG and as PNG."""

from collections.abc import Callable, Mapping

import pandas as pd
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.style import save, style
from spinepipe.studies.cohort_stiffness.figures.error_map import error_map_figure
from spinepipe.studies.cohort_stiffness.figures.held_out_error import held_out_error_figure
from spinepipe.studies.cohort_stiffness.figures.load_case_stiffness import (
    load_case_stiffness_figure,
)
from spinepipe.studies.cohort_stiffness.figures.stiffness_by_level import stiffness_by_level_figure
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.tables import read_frames

Draw = Callable[[CohortStiffness, Cohort, Mapping[str, pd.DataFrame]], Figure]

DRAW: dict[str, Draw] = {
    "stiffness_by_level": stiffness_by_level_figure,
    "error_map": error_map_figure,
    "held_out_error": held_out_error_figure,
    "load_case_stiffness": load_case_stiffness_figure,
}
"""What draws each figure; its tables are in ``COHORT_FIGURES`` of the layout."""


def run(root: str, study: str, figure: str, tables: list[str], svg: str, png: str) -> None:
    """Draw a figure, one of `DRAW`, from the files of its tables."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = read_frames(tables)
    with style():
        drawn = DRAW[figure](settings, cohort, rows)
        for path in (svg, png):
            save(drawn, path, digest_of("cohort_stiffness.figures", settings, cohort))
