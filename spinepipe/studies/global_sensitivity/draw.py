"""Job: one figure of a global sensitivity study, as SVG and as PNG."""

from collections.abc import Callable

from matplotlib.figure import Figure

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.style import save, style
from spinepipe.studies.global_sensitivity.figures.convergence import convergence_figure
from spinepipe.studies.global_sensitivity.figures.indices import indices_figure
from spinepipe.studies.global_sensitivity.figures.scatter import scatter_figure
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.tables import read_frames

DRAW: dict[str, Callable[..., Figure]] = {
    "factor_indices": indices_figure,
    "index_convergence": convergence_figure,
    "top_factors": scatter_figure,
}
"""What draws each figure from its tables, in the order of `layout.SENSITIVITY_FIGURES`."""


def run(root: str, study: str, figure: str, tables: list[str], svg: str, png: str) -> None:
    """Draw a figure, one of `DRAW`, from the files of its tables."""
    settings, cohort = study_of_kind(GlobalSensitivity, root, study)
    rows = read_frames(tables).values()
    with style():
        drawn = DRAW[figure](cohort, *rows)
        for path in (svg, png):
            save(drawn, path, digest_of("global_sensitivity.figures", settings, cohort))
