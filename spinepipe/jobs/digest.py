"""What a result file hangs on, as one digest, and where it comes from, for its metadata."""

import hashlib
import json
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.files import Stamp, stamp
from spinepipe.jobs.code import code_digest, effect_modules
from spinepipe.marks import KEY, read_mark
from spinepipe.studies.base_model import made_by
from spinepipe.studies.registry import PACKAGE, kind_of, place_of
from spinepipe.studies.study import Study


def value_digest(*values: Any) -> str:
    """sha256 over plain values (what JSON can hold), independent of the order of keys."""
    text = json.dumps(values, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


_LIBRARIES = (
    *("numpy", "scipy", "numba", "pandas", "pyarrow", "pybullet", "SALib", "scikit-learn"),
    *("statsmodels", "matplotlib", "Jinja2", "spinepipe"),
)


@cache
def versions() -> dict[str, str]:
    """Version of Python and of each library that results depend on.

    Raises
    ------
    ImportError
        For one that is not installed, with what to do.
    """
    try:
        found = {f"version_{name.lower()}": version(name) for name in _LIBRARIES}
    except PackageNotFoundError as error:
        raise ImportError(
            f"The environment is incomplete: the package {error.name} is not installed. Run "
            "`make env`; if it finds nothing to do, remove the folder .venv first"
        ) from None
    return {"version_python": platform.python_version(), **found}


def settings_of(study: Study, ignored: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a study but for what is ignored of them, as plain values."""
    return study.model_dump(mode="json", exclude=dict(ignored))


_read: list[str] = []


@contextmanager
def reading(paths: Iterable[str]) -> Iterator[None]:
    """What is written meanwhile hangs on the marks of these files, which a job is about to read.

    So that a job that makes tables of tables need not say what it has read: its rule did.
    """
    _read[:] = [mark_of(path) for path in paths]
    try:
        yield
    finally:
        _read.clear()


def digest_of(
    job: str,
    study: Study,
    cohort: Cohort,
    specimens: Sequence[str] | None = None,
    others: Sequence[str] = (),
) -> str:
    """The mark of a file that a job of the study's kind writes: all that it hangs on.

    Parameters
    ----------
    specimens : those that the job reads; none of them, the cohort's header alone; None, all.
    others : what else it reads that decides, such as the mark of another file.
    """
    return value_digest(
        _code(study, job),
        settings_of(study, kind_of(study.kind).job(job).ignores),
        _data_digest(cohort, specimens),
        [*others, *_read],
    )


def mark_of(path: str) -> str:
    """The mark of a file that a job reads, for the mark of what it writes."""
    return _mark(stamp(path))


@lru_cache(maxsize=64)
def _mark(where: Stamp) -> str:
    return read_mark(where[0])


def base_marks(root: str, model: str | None) -> list[str]:
    """The mark of a model file among a study's results, else digests of its bytes and its effects.

    Nothing without a file. The mark of a result covers the code of the effects in it already.

    Parameters
    ----------
    model : the file, absolute or relative to ``root``.
    """
    if model is None:
        return []
    path = Path(root) / model
    mark = read_mark(path) if made_by(path, Path(root)) else ""
    if mark:
        return [mark]
    raw = path.read_bytes()
    named = effect_modules()
    used = sorted(name for name in named if name.encode() in raw)
    return [hashlib.sha256(raw).hexdigest(), *(code_digest(named[name]) for name in used)]


def figure_digest(figure: str, study: Study, cohort: Cohort, read: Sequence[str]) -> str:
    """The mark of a figure; ``read`` are those of what it is drawn from."""
    kind = kind_of(study.kind)
    module = f"{PACKAGE}.{study.kind}.{kind.figure(figure).at.partition(':')[0]}"
    code = [code_digest("spinepipe.jobs.draw"), code_digest(module)]
    ignored = dict.fromkeys(kind.ignored_by_figures, True)
    return value_digest(code, settings_of(study, ignored), cohort.digest, list(read))


def report_digest(page: str, study: Study, cohort: Cohort, read: Sequence[str]) -> str:
    """The mark of a page (`report` or `full`), which prints all settings.

    Parameters
    ----------
    read : marks of the tables, figures and other results that it shows.
    """
    module = f"{PACKAGE}.{study.kind}.page"
    titles = [figure.title for figure in kind_of(study.kind).figures]
    code = [code_digest("spinepipe.jobs.report"), code_digest(module), titles]
    return value_digest(page, code, settings_of(study, {}), cohort.digest, list(read))


def provenance(
    job: str,
    study: Study,
    cohort: Cohort,
    specimens: Sequence[str] | None = None,
    others: Sequence[str] = (),
) -> dict[str, str]:
    """Metadata of a file that a job of the study's kind writes, its mark among it.

    ``config_digest`` covers the settings that the job depends on, no others; ``data_digest`` what
    it reads of the cohort, which is also told as ``cohort_digest`` where that is all of it and as
    ``specimens_digest`` where not. Parameters as in `digest_of`.
    """
    settings = settings_of(study, kind_of(study.kind).job(job).ignores)
    name = "cohort_digest" if specimens is None else "specimens_digest"
    read = cohort.digest if specimens is None else cohort.digest_of(specimens)
    return {
        "study": study.study,
        "kind": study.kind,
        "seed": str(getattr(study, "seed", "")),
        "data_digest": read,
        name: read,
        "config_digest": value_digest(settings),
        "code_digest": _code(study, job),
        KEY: digest_of(job, study, cohort, specimens, others),
        **versions(),
    }


def _code(study: Study, job: str) -> str:
    return code_digest(place_of(study.kind, job).partition(":")[0])


def _data_digest(cohort: Cohort, specimens: Sequence[str] | None) -> str:
    """Of the specimens' data as they were read; of a whole cohort its files too, words and all."""
    if specimens is None:
        return value_digest(cohort.digest, cohort.digest_of(cohort.specimen_names))
    return cohort.digest_of(specimens)
