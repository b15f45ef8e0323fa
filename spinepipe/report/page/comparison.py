"""A page of its own for each paper: its numbers beside ours."""

import pandas as pd

from spinepipe.report.page.study_page import rendered
from spinepipe.report.page.tables import beside_paper, judged
from spinepipe.schema import Table
from spinepipe.studies.study import Study

AGAINST = "against_"
"""How tables begin that set a paper's numbers beside ours."""


def paper_of(table: str) -> str:
    """``against_gould_2024b`` is Gould et al. 2024b."""
    first, _, year = table.removeprefix(AGAINST).partition("_")
    return f"{first.capitalize()} et al. {year}"


def comparison(shape: Table, title: str, rows: pd.DataFrame, study: Study) -> str:
    """The page of a table `against_*`: how many of its numbers agree, then all of them."""
    answer, _, details = judged(rows).partition(". ")
    return rendered(
        "comparison.html",
        title=f"{study.study}: {title}",
        study=study.study,
        heading=title,
        answer=f"{answer}.",
        details=details,
        tables=beside_paper(shape, title, rows),
    )
