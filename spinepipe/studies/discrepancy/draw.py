"""Job: one figure of a search for missing effects, as SVG and as PNG."""

from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.discrepancy import DRAW
from spinepipe.report.style import save, style
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.verdict import read_verdict
from spinepipe.tables import read_frames


def run(
    root: str, study: str, figure: str, tables: list[str], verdict: str, svg: str, png: str
) -> None:
    """Draw a figure, one of `DRAW`, from the files of its tables and of the verdict."""
    settings, cohort = study_of_kind(Discrepancy, root, study)
    rows, told = read_frames(tables), read_verdict(verdict)
    with style():
        drawn = DRAW[figure](cohort, told, rows)
        for path in (svg, png):
            save(drawn, path, digest_of("discrepancy.figures", settings, cohort))
