"""Job: one figure of a range-of-motion study, as SVG and as PNG."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.style import save, style
from spinepipe.studies.range_of_motion.figures import levels_figure, variance_figure
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.tables import read_frames

DRAW = {"range_of_motion": levels_figure, "rom_variance": variance_figure}
"""What draws each figure; its table is in `spinepipe.jobs.range_of_motion.layout.ROM_FIGURES`."""


def run(root: str, study: str, figure: str, tables: list[str], svg: str, png: str) -> None:
    """Draw a figure, one of `DRAW`, from the file of its table."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    (rows,) = read_frames(tables).values()
    with style():
        drawn = DRAW[figure](cohort, rows)
        for path in (svg, png):
            save(drawn, path, digest_of("range_of_motion.figures", settings, cohort))
