"""Read a cohort folder, or say everything that is wrong with it."""

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from hashlib import sha256
from itertools import islice
from pathlib import Path

import pandas as pd

from spinepipe.cohort.check_geometry import check_bodies, check_geometry
from spinepipe.cohort.checks import (
    check_header,
    check_loads,
    check_motion,
    check_steps,
    check_supports,
    usable_vertebrae,
)
from spinepipe.cohort.cohort import Cohort, CohortHeader, sd_of_reading
from spinepipe.cohort.columns import COHORT_YAML, TABLES
from spinepipe.cohort.draft import Draft, number_of_applied_loads
from spinepipe.cohort.zeroing import check_zeroing, common_zeroing
from spinepipe.documents.csv_table import read_table
from spinepipe.documents.form import TableForm
from spinepipe.documents.inside import outside
from spinepipe.documents.rules import TableCheck
from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import YamlDocument, read_yaml
from spinepipe.files import is_hidden
from spinepipe.problems import InputError, InputProblem, first_of

__all__ = ["Reader", "read"]

MOST_SPECIMENS = 1000

MOST_KEPT = 32
"""Cohorts that a reader keeps."""

MOST_APPLIED = 150_000
"""Rows of loads.csv with * and empty cycles written out: specimens x cycles x steps."""

LIKE = 0.8
"""Least likeness of two names without their endings: joint and joints have 0.91."""

MOST_FILES = 10_000
"""Files of a folder that are looked at."""

LONGEST = 40
"""Characters of a name that is looked at."""

ENDINGS = {
    ".csv": (".csv", ".csv.txt", ".txt", ".tsv"),
    ".yaml": (".yaml", ".yml", ".yaml.txt", ".yml.txt"),
}
"""Endings that programs give the files."""


def read(folder: Path, further: Sequence[TableForm] = ()) -> Cohort:
    """Read and validate one cohort folder, as `Reader.read` does."""
    return Reader().read(folder, further)


@dataclass(frozen=True)
class Reader:
    """Reads folders that do not change while it lives, the last `MOST_KEPT` of them once.

    `spinepipe check` asks for the cohort of each study, and for each cohort.
    """

    _known: dict[tuple[Path, tuple[TableForm, ...]], "_Outcome"] = field(default_factory=dict)

    def read(self, folder: Path, further: Sequence[TableForm] = ()) -> Cohort:
        """Read and validate one cohort folder.

        Parameters
        ----------
        folder : ``config/cohorts/<cohort>``, or any other folder of the same form.
        further : files that are read besides those of every cohort, where they are there.

        Raises
        ------
        InputError
            With every problem of every file of the folder.
        """
        folder = Path(folder)
        if not folder.is_dir():
            found, allowed = "no such folder", "a folder with cohort.yaml and specimens.csv"
            raise InputError(
                [InputProblem(str(folder), None, None, found, allowed, "check the name")]
            )
        forms = TABLES | {form.stem: form for form in further}
        there = tuple(form for form in forms.values() if _is_there(folder / form.file))
        place = folder.resolve()
        known = self._known.pop((place, there), None) or _outcome(folder, place.name, forms)
        self._known[place, there] = known
        if len(self._known) > MOST_KEPT:
            del self._known[next(iter(self._known))]
        absent = [form.file for form in forms.values() if form not in there]
        problems = [*misnamed(folder, place.name, absent), *known.problems]
        if problems or known.cohort is None:
            raise InputError(problems)
        return known.cohort


@dataclass(frozen=True)
class _Outcome:
    """What reading came to: a cohort, or problems."""

    cohort: Cohort | None
    problems: Sequence[InputProblem]


@contextmanager
def _uncollected() -> Iterator[None]:
    """Python does not look for circles among millions of cells, of which there are none.

    It would do so again and again while they grow in number: a third of the time that a file of
    4 million cells takes.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@_uncollected()
def _outcome(folder: Path, name: str, forms: Mapping[str, TableForm]) -> _Outcome:
    """Read and validate, whatever other files may be called."""
    document, header, problems = _read_header(folder, name)
    tables, absent = _read_tables(folder, name, forms, problems)
    draft = _within_bounds(
        Draft(
            name=name,
            vertebrae=usable_vertebrae(document) if document else (),
            gravity=document.data.get("gravity") is True if document else None,
            tables=tables,
            absent=absent,
            forms=forms,
        ),
        problems,
    )
    problems += _broken_rules(draft, problems)
    for found in (
        check_geometry(draft),
        check_bodies(draft),
        check_loads(draft, draft.applied),
        check_steps(draft, draft.applied),
        check_motion(draft, draft.applied),
    ):
        problems += first_of(found)
    problems += check_supports(draft, document)
    problems += check_zeroing(draft, document)
    if problems or header is None:
        return _Outcome(None, tuple(InputError(problems).problems))
    return _Outcome(_cohort(folder, header, tables, forms), ())


def _read_header(
    folder: Path, name: str
) -> tuple[YamlDocument | None, CohortHeader | None, list[InputProblem]]:
    file = f"{name}/{COHORT_YAML}"
    if not _is_there(folder / COHORT_YAML):
        return None, None, [_missing(file), *misnamed(folder, name, [COHORT_YAML])]
    led_out = outside(folder / COHORT_YAML, folder, (file, None, None), COHORT_YAML)
    if led_out is not None:
        return None, None, [led_out]
    document, problems = read_yaml(folder / COHORT_YAML, file)
    if document is None:
        return None, None, problems
    header, faults = validate(CohortHeader, document)
    return document, header, [*problems, *faults, *check_header(document, name)]


def _is_there(path: Path) -> bool:
    """Whether there is something of this name, be it a folder or a dead link."""
    return path.exists() or path.is_symlink()


def _read_tables(
    folder: Path, name: str, forms: Mapping[str, TableForm], problems: list[InputProblem]
) -> tuple[dict[str, pd.DataFrame], frozenset[str]]:
    """Tables by stem and the stems without a file; what is wrong is added to ``problems``."""
    tables: dict[str, pd.DataFrame] = {}
    absent = {stem for stem, form in forms.items() if not _is_there(folder / form.file)}
    if "specimens" in absent:
        problems.append(_missing(f"{name}/{TABLES['specimens'].file}"))
    for stem, form in forms.items():
        if stem in absent:
            continue
        file = f"{name}/{form.file}"
        led_out = outside(folder / form.file, folder, (file, None, None), form.file)
        if led_out is not None:
            problems.append(led_out)
            continue
        table, faults = read_table(folder / form.file, form, file)
        problems += faults
        if table is not None:
            tables[stem] = table
    return tables, frozenset(absent)


def _within_bounds(draft: Draft, problems: list[InputProblem]) -> Draft:
    """The draft without tables that mean more than can be looked at, which is added to problems."""
    number = len(draft.specimens)
    if number > MOST_SPECIMENS:
        allowed, remedy = f"at most {MOST_SPECIMENS}", "split the cohort"
        place = (draft.file("specimens"), None, None)
        problems.append(InputProblem(*place, f"{number} specimens", allowed, remedy))
        return _without(draft, "specimens", "loads")
    number = number_of_applied_loads(draft)
    if number > MOST_APPLIED:
        found = f"{number} loads, with * as every specimen and an empty cycle as every cycle"
        place = (draft.file("loads"), None, None)
        remedy = "look for wrong numbers in the columns cycle, or split the cohort"
        problems.append(InputProblem(*place, found, f"at most {MOST_APPLIED}", remedy))
        return _without(draft, "loads")
    return draft


def _without(draft: Draft, *stems: str) -> Draft:
    return replace(draft, tables={s: t for s, t in draft.tables.items() if s not in stems})


def _broken_rules(draft: Draft, problems: Sequence[InputProblem]) -> Iterator[InputProblem]:
    """What the tables do not keep of their forms, where their cells could be read."""
    for stem, table in draft.tables.items():
        file = draft.file(stem)
        refused = {(one.row, one.column) for one in problems if one.file == file}
        check = TableCheck(draft.forms[stem], file, table, refused, draft.known, draft.tables)
        yield from first_of(check.problems())


def _missing(file: str) -> InputProblem:
    return InputProblem(file, None, None, "no such file", "a file of this name", "add it")


def _cohort(
    folder: Path,
    header: CohortHeader,
    tables: dict[str, pd.DataFrame],
    forms: Mapping[str, TableForm],
) -> Cohort:
    final = {stem: _final(table) for stem, table in tables.items() if stem in TABLES}
    numbered = _numbered(final.get("motion"))
    sd = sd_of_reading(header.measurement_sd, header.accuracy)
    motion, zeroed = common_zeroing(numbered, header.zeroed_at_step_0, sd)
    return Cohort(
        name=header.cohort,
        title=header.title,
        source=header.source,
        folder=folder,
        vertebrae=header.vertebrae,
        gravity=header.gravity,
        zeroed_at_step_0=zeroed,
        measurement_sd=header.measurement_sd,
        accuracy=header.accuracy,
        specimens=final["specimens"],
        landmarks=final.get("landmarks"),
        joints=final.get("joints"),
        bodies=final.get("bodies"),
        loads=final.get("loads"),
        motion=motion,
        supports=final.get("supports"),
        preload=final.get("preload"),
        made_up=header.made_up,
        rebuilt=header.rebuilt,
        acknowledged_warnings=header.acknowledged_warnings,
        digest=_digest(folder, forms),
        further={stem: table for stem, table in tables.items() if stem not in TABLES},
    )


def _final(table: pd.DataFrame) -> pd.DataFrame:
    """The table without line numbers, steps as whole numbers."""
    table = table.reset_index(drop=True)
    return table.astype({"step": "int64"}) if "step" in table else table


def _numbered(motion: pd.DataFrame | None) -> pd.DataFrame | None:
    """Motion whose cycles are all numbered: an empty cell is the first."""
    if motion is None:
        return None
    return motion.assign(cycle=motion["cycle"].fillna(1.0).astype("int64"))


def _digest(folder: Path, forms: Mapping[str, TableForm]) -> str:
    digest = sha256()
    for file in sorted([COHORT_YAML, *(form.file for form in forms.values())]):
        if (folder / file).is_file():
            digest.update(file.encode() + b"\0" + sha256((folder / file).read_bytes()).digest())
    return digest.hexdigest()


def misnamed(folder: Path, name: str, absent: Sequence[str]) -> Iterator[InputProblem]:
    """Files that are most likely the absent ones, which would count as tables left out.

    Notes and raw data may lie beside the tables, so only names very like an absent one are told.

    Parameters
    ----------
    folder, name : of the cohort, and how messages call it.
    absent : names of files that are looked for and not there.
    """
    for path in sorted(islice(folder.iterdir(), MOST_FILES)):
        if len(path.name) > LONGEST or is_hidden(path.name) or not path.is_file():
            continue
        meant = next((file for file in absent if _is_like(path.name, file)), None)
        if meant is not None:
            place = (f"{name}/{path.name}", None, None)
            remedy = f"did you mean '{meant}'? Rename it; or give it a name that is not so similar"
            yield InputProblem(*place, "a file that is not read", f"the name {meant}", remedy)


def _is_like(name: str, file: str) -> bool:
    """Whether a file's name is that of a table, but for case, ending or a letter or two."""
    stem, ending = file.rpartition(".")[::2]
    written = name.casefold()
    for known in ENDINGS[f".{ending}"]:
        if written.endswith(known):
            found = written.removesuffix(known)
            exact = known == f".{ending}"
            return found == stem or (exact and _likeness(found, stem) >= LIKE)
    return False


def _likeness(one: str, other: str) -> float:
    """1 for equal names and for singular and plural, 0 for names with nothing in common."""
    plural = f"{one.removesuffix('y')}ies" if one.endswith("y") else f"{one}s"
    return 1.0 if plural == other else SequenceMatcher(None, one, other).ratio()
