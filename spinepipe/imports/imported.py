"""A cohort that is read and not yet written, and how it is written: as a whole or not at all."""

import csv
import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from dataclasses import replace as with_values
from functools import cache
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import numpy as np
import yaml
from pydantic import AfterValidator, BaseModel, Field, StringConstraints

from spinepipe.cohort.cohort import FORM, VertebraName
from spinepipe.cohort.columns import COHORT_YAML, TABLES
from spinepipe.documents.form import TableForm, read_forms
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.frames import Pose, zxy_angles
from spinepipe.motion.reading import axes_of
from spinepipe.problems import InputError, InputProblem
from spinepipe.schema import Column, Table
from spinepipe.schema.datapackage import FILE, descriptor
from spinepipe.studies.registry import every_form
from spinepipe.units import MM_PER_M

CARRIED = read_forms(Path(__file__).with_name("forms.yaml"))
"""Tables that an import writes and that no study reads, by stem."""


@cache
def all_forms() -> Mapping[str, TableForm]:
    """Every table that a cohort may have, by stem."""
    return {**TABLES, **{form.stem: form for form in every_form()}, **CARRIED}


LineText = Annotated[str, StringConstraints(min_length=1)]


def _axes(text: str) -> str:
    axes_of(text)
    return text


AxesText = Annotated[str, AfterValidator(_axes)]
"""What forwards, up and right are on the axes of files, as in `x z -y`."""


class CohortTitle(BaseModel):
    """What every settings file of an import says of the cohort that is made."""

    model_config = FORM

    cohort: str = Field(pattern=r"^[a-z0-9_]+$", description="name of the folder that is made")
    title: LineText = Field(description="one line that says what the cohort is")
    source: LineText = Field(description="who measured what, when, how; licence")


class ImportSettings(CohortTitle):
    """The same, and the vertebrae, where no file tells them."""

    vertebrae: tuple[VertebraName, ...] = Field(
        strict=False,
        min_length=2,
        description="names from caudal to cranial, the first is fixed to ground",
    )


UNITS = {
    **{"mm": "mm", "deg": "deg", "n": "N", "nm": "N m", "s": "s"},
    **{"kg": "kg", "m": "m", "m2": "kg m2", "years": "years"},
}
"""Units as names of columns end with them."""

Rows = list[Sequence[object]]

POINT = ("x_mm", "y_mm", "z_mm")
FRAME = (*POINT, "extension_deg", "right_bending_deg", "left_rotation_deg")

Made = tuple[dict[str, Rows], list[str]]
"""Rows of tables by file, and sentences."""


@dataclass(frozen=True)
class ImportedCohort:
    """What an import makes of the files of a laboratory.

    Attributes
    ----------
    name : of the cohort and its folder. title : one line.
    files : of the folder, by name: a text, or a file that is copied as it is.
    by_hand : those that are made to be edited: they stay when a folder is made again; with what
        is to be said of each where it is new.
    sentences : what was done, for people.
    forms : of tables that are no cohort's own, as kinds of study read them; told in
        ``datapackage.json``.
    settings : the file that says what the files are.
    made_by : dotted keys of the settings that made a column, by stem of the table and column; where
        they hold a mapping, its `unit`, `positive` and `column` are told by themselves.
    tests_of : specimens and tests that such a key is of; not there: all.
    units : sizes of units that may stand there, by name; those of one quantity together.
    origins : of each row of a table, by stem: the file and line that it came from.
    first_rows : of each file as they were understood, by its name: names of columns, then cells.
    """

    name: str
    title: str
    files: Mapping[str, str | Path]
    by_hand: Mapping[str, str]
    sentences: tuple[str, ...]
    forms: tuple[TableForm, ...] = field(default=())
    settings: YamlDocument | None = None
    made_by: Mapping[tuple[str, str], Sequence[str]] = field(default_factory=dict)
    tests_of: Mapping[str, Set[tuple[str, str]]] = field(default_factory=dict)
    units: Sequence[Mapping[str, float]] = ()
    origins: Mapping[str, Sequence[tuple[str, int | None]]] = field(default_factory=dict)
    first_rows: Mapping[str, Sequence[Sequence[object]]] = field(default_factory=dict)


def write(
    imported: ImportedCohort,
    folder: Path,
    replace: bool,
    look: Callable[[Path], None] | None = None,
) -> list[str]:
    """Write the cohort folder, and return the names of files that were there and stayed.

    Parameters
    ----------
    replace : whether a folder that is there may be written again; what is edited by hand stays,
        and so does what the import does not write.
    look : looks at the folder as it would be, and raises where it must not be written.

    Raises
    ------
    InputError
        When the folder is there and must not be touched, and what ``look`` raises.
    """
    if folder.exists() and not replace:
        remedy = "choose another `cohort:` in the YAML, or add --replace"
        found = "a folder of this name"
        raise InputError([InputProblem(str(folder), None, None, found, "a new folder", remedy)])
    stay = [name for name in imported.by_hand if (folder / name).exists()]
    folder.parent.mkdir(parents=True, exist_ok=True)
    aside = folder.with_name(f".{folder.name}.{os.getpid()}")
    new = aside / folder.name  # of its own name, which is asked when it is read
    old = folder.with_name(f".{folder.name}.before.{os.getpid()}")
    shutil.rmtree(aside, ignore_errors=True)
    aside.mkdir()
    try:
        if folder.exists():
            shutil.copytree(folder, new)
        else:
            new.mkdir()
        for name, content in imported.files.items():
            if isinstance(content, Path):
                shutil.copyfile(content, new / name)
            elif name not in stay:
                meant = _meant(folder, imported) if name == COHORT_YAML else {}
                stay += [f"{key}: true of {COHORT_YAML}" for key in meant]
                text = _yaml(yaml.safe_load(content) | meant) if meant else content
                (new / name).write_text(text, encoding="utf-8")
        (new / FILE).write_text(_descriptor(imported, new), encoding="utf-8")
        if look is not None:
            look(new)
        # the new folder is whole before the old one goes, and the old one is kept until it is there
        if folder.exists():
            folder.rename(old)
        try:
            new.rename(folder)
        except OSError:
            if old.exists():
                old.rename(folder)
            raise
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return stay


def _meant(folder: Path, imported: ImportedCohort) -> Mapping[str, bool]:
    """What somebody has said in the old ``cohort.yaml`` and files of a laboratory do not tell."""
    path = folder / COHORT_YAML
    old = yaml.safe_load(path.read_text(encoding="utf-8")) if path.is_file() else None
    keys = ["made_up", "rebuilt", *(["gravity"] if "bodies.csv" not in imported.files else [])]
    return {key: True for key in keys if isinstance(old, dict) and old.get(key) is True}


def _yaml(header: Mapping[str, object]) -> str:
    return yaml.safe_dump(dict(header), sort_keys=False, allow_unicode=True, width=110)


def assembled(
    settings: ImportSettings,
    made_of: str,
    tables: Mapping[str, Sequence[Sequence[object]]],
    sentences: Sequence[str],
    origins: Mapping[str, Sequence[tuple[str, int | None]]],
    copied: Mapping[str, Path] = MappingProxyType({}),
    further: Mapping[str, object] = MappingProxyType({}),
) -> ImportedCohort:
    """A cohort of these tables.

    Parameters
    ----------
    made_of : end of the sentence that says what the cohort was made of.
    tables : rows by stem, cells in the order of the form; tables without rows are left out.
    origins : as in `ImportedCohort`.
    copied : files that become part of the folder as they are, by their names there.
    further : keys of ``cohort.yaml`` besides those that all imports have.
    """
    forms = all_forms()
    header = settings.model_dump(include=set(ImportSettings.model_fields), mode="json")
    source = settings.source.rstrip(". ")
    header["source"] = f"{source}. Made by `spinepipe import` of {made_of}"
    header |= {"gravity": "bodies.csv" in copied, **further}
    texts = {
        forms[stem].file: csv_text([forms[stem].names[: len(rows[0])], *rows])
        for stem, rows in tables.items()
        if rows
    }
    return ImportedCohort(
        settings.cohort,
        settings.title,
        {COHORT_YAML: _yaml(header), **texts, **copied},
        {"specimens.csv": ""},
        tuple(sentences),
        tuple(form for stem, form in forms.items() if stem not in TABLES),
        origins=origins,
    )


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Rows as the text of a table, the header first."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def rounded(value: float) -> str:
    """A number of a table: six decimals at most, no minus before zero."""
    return f"{round(float(value), 6) + 0.0:.10g}"


def cells(values: Iterable[float], decimals: int = 9) -> list[str]:
    """Numbers of a row, so that nothing of a model is lost."""
    return [f"{round(float(value), decimals) + 0.0:.15g}" for value in values]


def pose_cells(pose: Pose) -> list[str]:
    """A frame in ground, columns `FRAME`."""
    return cells([*pose.origin * MM_PER_M, *np.degrees(zxy_angles(pose.rotation))])


def _descriptor(imported: ImportedCohort, folder: Path) -> str:
    """What the columns of the tables are, for other programs; nothing here reads it."""
    forms = [*TABLES.values(), *imported.forms]
    tables = [
        (_shape(form, (folder / form.file).read_text("utf-8", "replace")), form.file)
        for form in forms
        if (folder / form.file).is_file()
    ]
    return descriptor(imported.name, imported.title, tables)


def _shape(form: TableForm, text: str) -> Table:
    """What the columns of a file of a cohort are, in its own order; somebody's own are text."""
    declared: dict[str, Column] = {
        one.name: with_values(one, unit=UNITS.get(one.name.rpartition("_")[2], ""))
        for one in form.columns
    }
    header = next(csv.reader(StringIO(text)), [])
    own = {name: Column(name, "text", "carried through", nullable=True) for name in header}
    columns = tuple((own | declared)[name] for name in header)
    keys = tuple(key for key in form.keys if key in header)
    return Table(form.stem, f"One row per {form.row}", keys, columns)
