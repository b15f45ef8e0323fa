"""Job: one figure of a study of any kind, as SVG, PDF and PNG."""

from spinepipe.jobs.digest import figure_digest, mark_of
from spinepipe.jobs.inputs import study_of
from spinepipe.marks import write_marked
from spinepipe.studies.registry import function_at, kind_of
from spinepipe.tables import StudyTables


def run(
    root: str,
    study: str,
    figure: str,
    tables: list[str],
    svg: str,
    pdf: str,
    png: str,
    **others: str,
) -> None:
    """Draw a figure that the kind declares, from the files of its tables and ``others``."""
    settings, cohort = study_of(root, study)
    draw = function_at(settings.kind, kind_of(settings.kind).figure(figure).at)
    digest = figure_digest(
        figure, settings, cohort, [mark_of(path) for path in [*tables, *others.values()]]
    )
    read = StudyTables.read(tables, others)
    chart = draw(settings, cohort, read)
    write_marked(chart.svg(), svg, digest)
    for kind, path in (("pdf", pdf), ("png", png)):
        write_marked(chart.picture(kind), path, digest)
