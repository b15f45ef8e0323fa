"""`spinepipe archive`: one study as a zip, for the supplement of a paper.

What went in, what came out and what it was made with; no job files, which can be made again. The
same files give the same bytes: names are in order, and no date of a file is in the zip.
"""

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Annotated
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import typer

from spinepipe.citing.cite import CommitUnknown, commit_of_code
from spinepipe.cli.find import known_study
from spinepipe.files import appearing, is_hidden
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.project import RUNNING, AtWork, lock
from spinepipe.jobs.report import descriptor_of
from spinepipe.marks import mark_in
from spinepipe.muscles.myo_sim import origin_of_myo_sim
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.page.origin import origin
from spinepipe.report.words import count
from spinepipe.schema.datapackage import FILE
from spinepipe.shipped import SHIPPED
from spinepipe.studies import read as studies
from spinepipe.studies.base_model import made_by
from spinepipe.studies.study import STUDIES, Study
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_metadata

_NO_DATE = (1980, 1, 1, 0, 0, 0)
"""The first that a zip can tell."""

_README = """\
Study {study} ({kind}) of the cohort {cohort}: {title}
Source of the data: {source}

config/            what went in: the study, its cohort, and config.yaml, which chooses the study
results/           what came out: tables (*.parquet, explained in datapackage.json), figures, and
                   pages for a browser (report.html)
requirements.lock  the libraries, with versions and checksums

CODE
{code}
The digests below are of the code and the settings that each table was made with.

TO MAKE IT AGAIN
Take the code of that commit, remove its folders config and results, put config from here in their
place, and run `{run_by}` (Python 3.11, on Linux). A file that has the same result_digest inside is
made of the same code, settings and data.
{elsewhere}
MADE WITH
{facts}

DIGESTS (table, code, settings)
{digests}

FILES (sha256, name)
{files}
"""


def command(
    context: typer.Context,
    study: Annotated[str, typer.Argument(help="name of a study that was computed")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE.zip", help="default: STUDY.zip"),
    ] = None,
) -> int:
    """Pack a computed study as a zip, for the supplement of a paper."""
    root, name = context.obj, study
    output = (output or Path(f"{name}.zip")).resolve()
    if output.suffix != ".zip":
        at = "command line", None, "-o"
        raise InputError([InputProblem(*at, output.name, "FILE.zip", "rename it")])
    expected = Expected(str(root), *studies.check(root, known_study(name, root), starting=False))
    files = expected.files
    full = [path for path in files.results(full=True) if path not in files.results()]
    full = [path for path in full if (root / path).exists()]
    results, run_by = [*files.results(), *full], "make full" if full else "make"
    with _no_run_at_work(root):
        _refuse_others(expected, results, run_by)
        packed = {result: (root / result).read_bytes() for result in results}
        of_tables = [root / path for path in results if path.endswith(".parquet")]
        tables = {path.stem: read_metadata(path) for path in of_tables}
        told = descriptor_of(expected.study, expected.cohort, root / files.folder)
        # written beside the page, of what the tables say
        beside = f"{files.folder}/{CONCLUSIONS.name}.parquet"
        if (root / beside).is_file():
            packed[beside] = (root / beside).read_bytes()
        elsewhere = set(_packages(expected.study))
        for path in _inputs(expected):
            shown = os.path.normpath(str(path).removeprefix(f"{root}/"))
            inside = path.resolve().is_relative_to(root) and not shown.startswith(("..", "/"))
            if path.resolve() != output and inside:
                packed[shown] = path.read_bytes()
            elif not inside:
                elsewhere.add(f"{sha256(path.read_bytes()).hexdigest()}  {shown}")
    packed[f"{files.folder}/{FILE}"] = told.encode()
    packed["config/config.yaml"] = f"studies: [{name}]\n".encode()
    if (SHIPPED / "requirements.lock").is_file():
        packed["requirements.lock"] = (SHIPPED / "requirements.lock").read_bytes()
    packed["README.txt"] = _readme(expected, packed, tables, elsewhere, run_by).encode()
    with appearing(output) as temporary, ZipFile(temporary, "w") as file:
        for within, content in sorted(packed.items()):
            entry = ZipInfo(f"{name}/{within}", _NO_DATE)
            entry.external_attr, entry.create_system = 0o644 << 16, 3  # a file, written on Unix
            file.writestr(entry, content, ZIP_DEFLATED)
    not_in = f", {count(len(elsewhere), 'input')} left out (README.txt says which)"
    print(f"{output}: {count(len(packed), 'file')}{not_in if elsewhere else ''}")
    return 0


@contextmanager
def _no_run_at_work(root: Path) -> Iterator[None]:
    """What is read meanwhile belongs together."""
    running = root / RUNNING
    if not os.access(running, os.W_OK):  # no run of this user could write, or none ever was
        yield
        return
    try:
        held = lock(running)
    except AtWork as run:
        found, allowed = f"a run at work: {run}", "results that no run changes"
        place = str(RUNNING), None, None
        raise InputError([InputProblem(*place, found, allowed, "wait until it ends")]) from None
    with held:
        yield


def _refuse_others(expected: Expected, results: Sequence[str], run_by: str) -> None:
    """Refuse results that are not there, not as written, or not of the study as it is now.

    Raises
    ------
    InputError
        With the first of each, and how many more there are.
    """
    wrong: dict[str, list[str]] = {}
    for path in results:
        mark = mark_in(Path(expected.root, path))
        if mark != expected.of_file(path):
            why = "a result of other settings, data or code" if mark else "a damaged file"
            wrong.setdefault("no such file" if mark is None else why, []).append(path)
    name = expected.study.study
    remedy = f"run `{run_by}` with {name} among the studies of config/config.yaml"
    allowed = "what the study makes as it is now"
    if wrong:
        raise InputError(
            InputProblem(paths[0], None, None, found, allowed, remedy, others=len(paths) - 1)
            for found, paths in wrong.items()
        )


def _inputs(expected: Expected) -> Iterator[Path]:
    """Files that went in: study, cohort, the model it builds on, and what went into that one."""
    root, study = Path(expected.root), expected.study
    yield root / STUDIES / f"{study.study}.yaml"
    for place, folders, names in os.walk(study.cohort_folder(root)):
        folders[:] = [name for name in folders if not is_hidden(name)]
        paths = (Path(place, name) for name in names if not is_hidden(name))
        yield from (path for path in paths if path.is_file())
    base = getattr(study, "base", None)
    if base is None or base.model is None:
        return
    yield base.path(root)
    maker = made_by(base.path(root), root)
    if maker is not None:
        other = Expected(expected.root, *studies.check(root, maker, starting=False))
        _refuse_others(other, [os.path.normpath(base.model)], "make")
        yield from _inputs(other)


def _readme(
    expected: Expected,
    packed: Mapping[str, bytes],
    tables: Mapping[str, Mapping[str, str]],
    elsewhere: Collection[str],
    run_by: str,
) -> str:
    """What says what is what.

    Parameters
    ----------
    packed : contents by name. tables : their metadata. elsewhere : lines on what is left out.
    run_by : the command that makes the study.
    """
    study, cohort = expected.study, expected.cohort
    of = origin(study, tables)
    not_in = ["", "NOT IN HERE (sha256, name), which the study reads too", *sorted(elsewhere)]
    return _README.format(
        **{"study": study.study, "kind": study.kind, "cohort": cohort.name, "run_by": run_by},
        **{"title": cohort.title, "source": cohort.source, "code": _commit()},
        elsewhere="".join(f"{line}\n" for line in not_in if elsewhere),
        facts="\n".join(f"{fact}: {value}" for fact, value in of.facts),
        digests="\n".join("  ".join(row) for row in of.digests),
        files="\n".join(f"{sha256(packed[path]).hexdigest()}  {path}" for path in sorted(packed)),
    )


def _packages(study: Study) -> Iterator[str]:
    """Data of an installed package, which has a licence of its own."""
    if getattr(study, "geometry", None) == "myo_sim":
        package = origin_of_myo_sim()
        yield f"{package.sha256}  the models of the package {package.name} {package.version}"


def _commit() -> str:
    """The commit of the code, and whether it was changed since; or why neither is known."""
    try:
        commit, changed = commit_of_code()
    except CommitUnknown as why:
        return str(why)
    return f"commit {commit}" + (f", with these changes:\n{changed}" if changed else ", unchanged")
