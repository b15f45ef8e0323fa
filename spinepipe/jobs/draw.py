"""Job: one figure of a study of any kind, as SVG and as PNG."""

from importlib import import_module

from spinepipe.jobs.digest import figure_digest, mark_of
from spinepipe.jobs.inputs import study_of
from spinepipe.report.style import save, style
from spinepipe.studies.registry import PACKAGE, kind_of
from spinepipe.tables import StudyTables


def run(
    root: str, study: str, figure: str, tables: list[str], svg: str, png: str, **others: str
) -> None:
    """Draw a figure that the kind declares, from the files of its tables and ``others``."""
    settings, cohort = study_of(root, study)
    module, _, function = kind_of(settings.kind).figure(figure).at.partition(":")
    draw = getattr(import_module(f"{PACKAGE}.{settings.kind}.{module}"), function)
    read = [mark_of(path) for path in [*tables, *others.values()]]
    with style():
        drawn = draw(settings, cohort, StudyTables.read(tables, others))
        for path in (svg, png):
            save(drawn, path, figure_digest(figure, settings, cohort, read))
