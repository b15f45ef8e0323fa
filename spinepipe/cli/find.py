"""What a name on the command line means: a study, a cohort, or the folder of one."""

import re
from collections.abc import Sequence
from pathlib import Path

from spinepipe import cohort as cohorts
from spinepipe.cli.program import WrongUsage
from spinepipe.cohort import Cohort
from spinepipe.files import files_in, folders_in
from spinepipe.problems import nearest
from spinepipe.studies import read as studies
from spinepipe.studies.registry import every_form
from spinepipe.studies.study import COHORTS, STUDIES, Study

ALL = "spinepipe check lists all; another folder is named by --root"
"""What to do about a study or cohort that there is not."""

MOST_NAMED = 5
"""Known names that are listed where none is near."""


def study_names(root: Path) -> list[str]:
    """Names of all study files."""
    return [path.stem for path in files_in(root / STUDIES, studies.ENDING)]


def cohort_names(root: Path) -> list[str]:
    """Names of all cohort folders."""
    return [path.name for path in folders_in(root / COHORTS)]


def study_or_cohort(name: str, root: Path) -> tuple[Study | None, Cohort]:
    """A study with its cohort, or a cohort alone; a study comes first if both have the name.

    Raises
    ------
    WrongUsage
        When there is neither.
    InputError
        With every problem found in them.
    """
    if name in study_names(root):
        return studies.check(root, name)
    if name in cohort_names(root):
        return None, cohorts.read(root / COHORTS / name, every_form())
    if (root / name).is_dir() and "/" in name:
        return None, cohorts.read(root / name, every_form())
    raise unknown("study or cohort", name, [*study_names(root), *cohort_names(root)])


def known_study(name: str, root: Path) -> str:
    """The name of a study, if there is one.

    Raises
    ------
    WrongUsage
        When there is none.
    """
    if name not in study_names(root):
        raise unknown("study", name, study_names(root))
    return name


def unknown(what: str, name: str, known: Sequence[str], otherwise: str = ALL) -> WrongUsage:
    """A name on the command line that nothing has, with the nearest three that there are.

    Parameters
    ----------
    otherwise : what to do where none is near and there are too many to be listed.
    """
    known = list(dict.fromkeys(known))  # a study and its cohort may be called alike
    near = nearest(name, known)
    listed = f"they are {', '.join(known)}" if 0 < len(known) <= MOST_NAMED else ""
    remedy = f"did you mean {' or '.join(near)}?" if near else listed
    return WrongUsage(f'there is no {what} "{name}"', remedy or otherwise)


def vertebrae_of(text: str) -> tuple[str, ...]:
    """Vertebrae as they are typed, from the lowest.

    Raises
    ------
    WrongUsage
        When there are fewer than two, between which there is no joint.
    """
    names = tuple(re.split(r"[\s,]+", text.strip()))
    if len(names) < 2:
        raise WrongUsage(f'the vertebrae "{text}"', 'name at least two, as in "L5 L4"')
    return names


def specimen_of(cohort: Cohort, name: str | None) -> str:
    """A specimen of a cohort; the first one where no name is given.

    Raises
    ------
    WrongUsage
        When the cohort has no such specimen.
    """
    if name is None:
        return str(cohort.specimen_names[0])
    if name not in cohort.specimen_names:
        remedy = f"specimens.csv of {cohort.name} lists all"
        raise unknown("specimen", name, cohort.specimen_names, remedy)
    return name
