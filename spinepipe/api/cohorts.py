"""Reading a cohort, and all that is wrong or odd about it as a table."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from spinepipe.cohort import Cohort, Reader
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.plausibility import doubts, refusals
from spinepipe.studies.read import check as check_study
from spinepipe.studies.registry import every_form
from spinepipe.studies.study import STUDIES

COLUMNS = ("severity", "file", "line", "column", "found", "allowed", "remedy")


def read_cohort(path: str | Path) -> Cohort:
    """Read and validate the folder of a cohort.

    Parameters
    ----------
    path : folder with ``cohort.yaml`` and the tables of docs/cohort-format.md.

    Returns
    -------
    Cohort
        With ``specimens``, ``loads`` and ``motion`` (data frames in the units of the files), and
        ``tests`` and ``joint_names``.

    Raises
    ------
    InputError
        With every problem of every file of the folder.

    Examples
    --------
    >>> import spinepipe as sp
    >>> cohort = sp.read_cohort("config/cohorts/l4l5_disc")
    >>> cohort.joint_names
    ('L4L5',)
    """
    return Reader().read(Path(path), every_form())


def check(what: Cohort | str | Path) -> pd.DataFrame:
    """All problems and warnings of a cohort, of the folder of one, or of a study.

    A ``problem`` stops a run. A ``warning`` does not: units, signs and exchanged names that no
    single cell gives away.

    Parameters
    ----------
    what : a cohort, its folder, or ``config/studies/<study>.yaml``.

    Returns
    -------
    DataFrame
        ``severity, file, line, column, found, allowed, remedy``; no rows where all is sound.

    Examples
    --------
    >>> import spinepipe as sp
    >>> len(sp.check("config/cohorts/l4l5_disc"))
    0
    """
    try:
        if isinstance(what, Cohort):
            cohort = what
        elif (path := Path(what)).suffix == ".yaml":
            root = path.absolute().parents[len(STUDIES.parts)]
            cohort = check_study(root, path.stem, starting=False)[1]
        else:
            cohort = read_cohort(path)
    except InputError as error:
        return pd.DataFrame(_rows("problem", error.problems), columns=COLUMNS)
    rows = [*_rows("problem", refusals(cohort)), *_rows("warning", doubts(cohort))]
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(severity: str, problems: Iterable[InputProblem]) -> list[tuple[object, ...]]:
    return [
        (severity, one.file, one.row, one.column, one.found, one.allowed, one.remedy)
        for one in problems
    ]
