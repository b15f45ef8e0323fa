"""What many jobs of one worker read again and again, kept as long as the files are the same."""

import os
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from spinepipe.cohort import Cohort
from spinepipe.files import Stamp, is_hidden, stamp
from spinepipe.studies.read import check, read
from spinepipe.studies.study import STUDIES, Study

KEPT_SPECIMENS = 128
"""Whose frames a worker keeps: jobs of different specimens come in any order."""

AnyStudy = TypeVar("AnyStudy", bound=Study)


@lru_cache(maxsize=8)
def _folder(name: str, root: str, _study_file: Stamp) -> Path:
    return read(Path(root) / STUDIES / f"{name}.yaml", Path(root)).cohort_folder(Path(root))


@lru_cache(maxsize=8)
def _study(
    name: str, root: str, _study_file: Stamp, _cohort_files: tuple[Stamp, ...]
) -> tuple[Study, Cohort]:
    return check(Path(root), name, starting=False)


def study_of(root: str, name: str) -> tuple[Study, Cohort]:
    """The validated study, of whatever kind, and its cohort."""
    return study_of_kind(Study, root, name)


def study_of_kind(kind: type[AnyStudy], root: str, name: str) -> tuple[AnyStudy, Cohort]:
    """The validated study and its cohort; read once per worker and state of the files.

    What an editor puts beside them, such as a link to nowhere, is none of them.
    """
    study_file = stamp(os.path.join(root, STUDIES, f"{name}.yaml"))
    with os.scandir(_folder(name, root, study_file)) as entries:
        read_ones = (e for e in entries if not is_hidden(e.name) and (e.is_file() or e.is_dir()))
        files = sorted((e.path, e.stat().st_size, e.stat().st_mtime_ns) for e in read_ones)
    study, cohort = _study(name, root, study_file, tuple(files))
    assert isinstance(study, kind)
    return study, cohort
