"""Results of a study that a run writes or wrote: tables as data frames, and how two runs differ."""

import shutil
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr

from spinepipe.api.arrays import arrays
from spinepipe.api.result import Shown, with_units
from spinepipe.api.study import Say
from spinepipe.files import project_root
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.start import Snakemake, cores_here
from spinepipe.marks import mark_in
from spinepipe.progress import silent
from spinepipe.report.conclusions import Told, read_back
from spinepipe.schema import Table
from spinepipe.studies.kind import Kind
from spinepipe.studies.read import ENDING, check
from spinepipe.studies.registry import files_of, kind_of
from spinepipe.studies.study import STUDIES
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame, read_metadata
from spinepipe.tidy.tables import tidied

TOLD_LINES = 20
"""Of what Snakemake said of a run that failed."""


class Results(Shown, Mapping[str, pd.DataFrame]):
    """The tables of a study by name, each read when it is first asked for, and what its page says.

    Attributes
    ----------
    path : folder of the results. files : of each table.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        # conclusions lie beside the page, tables of some kinds in a folder below
        places = (self.path, *sorted(one for one in self.path.glob("*") if one.is_dir()))
        for place in places:
            found = sorted(one for one in place.glob("*.parquet") if one.stem != CONCLUSIONS.name)
            if found:
                break
        else:
            raise FileNotFoundError(f"{path}: no tables; has the study run?")
        self.files = {one.stem: one for one in found}
        self._read: dict[str, pd.DataFrame] = {}

    def __getitem__(self, name: str) -> pd.DataFrame:
        """Rows of a table; units in ``attrs["units"]``."""
        if name not in self._read:
            rows = read_frame(self.files[name])
            self._read[name] = with_units(self.kind.table(name), rows)
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is such a table, which is not read for that."""
        return name in self.files

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)

    @cached_property
    def kind(self) -> Kind:
        """The declaration of the kind of study."""
        return kind_of(self.provenance["kind"])

    @cached_property
    def provenance(self) -> Mapping[str, str]:
        """Where the tables come from: study, kind, seed, digests, versions."""
        return read_metadata(next(iter(self.files.values())))

    @property
    def tables(self) -> pd.DataFrame:
        """A row per table: ``name``, ``rows``, and ``what`` a row stands for."""
        told = [(name, len(self[name]), self.kind.table(name).about) for name in self]
        return pd.DataFrame(told, columns=["name", "rows", "what"])

    @cached_property
    def conclusions(self) -> list[Told]:
        """What the page of the study says.

        Raises
        ------
        OSError
            Where it has no page yet.
        """
        return read_back(read_frame(self.path / f"{CONCLUSIONS.name}.parquet"))

    @cached_property
    def table(self) -> pd.DataFrame:
        """The first of the tidy tables: stiffness, loads, indices or angles."""
        table, rows = next(iter(self.tidy.values()))
        return with_units(table, rows)

    @cached_property
    def tidy(self) -> dict[str, tuple[Table, pd.DataFrame]]:
        """Tidy tables by name, each with what its columns are."""
        return tidied(self.provenance["kind"], self)

    def xarray(self, name: str) -> xr.Dataset:
        """A table as arrays over its keys; a unit that hangs on the row is told as in the table."""
        rows, shape = self[name], self.kind.table(name)
        return arrays(rows, shape.key, rows.attrs["units"])

    def plot(self, ax: Any = None) -> Any:
        """The key figure of the page, as a picture."""
        ax = ax or plt.subplots(layout="constrained")[1]
        folder = self.path / self.kind.files.subfolder / "figures"
        drawn = (folder / f"{one.name}.png" for one in self.kind.figures)
        if (path := next((one for one in drawn if one.is_file()), None)) is not None:
            ax.imshow(plt.imread(path))
        ax.axis("off")
        return ax

    def report(self, path: str | Path) -> None:
        """Copy the page of the study; links to tables lead nowhere from there."""
        shutil.copyfile(self.path / "report.html", path)

    @property
    def made_by(self) -> str:  # type: ignore[override]
        """The version of spinepipe that computed it."""
        return self.provenance["version_spinepipe"]

    @property
    def stale(self) -> list[str]:
        """Tables that settings, data or code of now would make anew; none where all are current.

        Raises
        ------
        InputError
            Where the study or its cohort is not sound any more.
        """
        root, name = self.path.absolute().parents[1], self.provenance["study"]
        expected = Expected(str(root), *check(root, name, starting=False))
        return [n for n in self if mark_in(self.files[n]) != expected.of_result(n)]


def run(
    study: str | Path, *, cores: int | None = None, force: bool = False, say: Say = silent
) -> Results:
    """Make the report of a study, and all that it needs, by Snakemake; jobs resume.

    Parameters
    ----------
    study : name of a study of the project in or above the working folder, or its file
        ``config/studies/<study>.yaml`` in any project.
    cores : jobs at a time; all cores that this process may use by default.
    force : make everything again, up to date or not.
    say : told how far the run is, such as `print`.

    Raises
    ------
    InputError
        With all that is wrong with the study and its cohort.
    RuntimeError
        Where a job fails, with the last lines that were said.
    """
    path = Path(study).absolute()
    if path.suffix == ENDING:
        root = path.parents[len(STUDIES.parts)]
    else:
        root, path = project_root(Path.cwd()), Path(study)
    checked = check(root, path.stem)
    asked = [files_of(*checked).page(), "--cores", f"{cores or cores_here()}"]
    process, lines = Snakemake(root, [*asked, *["--forceall"] * force], path.stem), list[str]()
    for event in process.events():
        if event["event"] == "progress":
            say(f"{event['done']} of {event['total']} jobs: {event['last']}")
        elif "text" in event:
            lines.append(event["text"])
            say(event["text"])
    if process.code:
        raise RuntimeError("\n".join([f"{path.stem}: a job failed", *lines[-TOLD_LINES:]]))
    return Results(root / "results" / path.stem)


def open_results(path: str | Path) -> Results:
    """The results of a study that a run wrote.

    Parameters
    ----------
    path : ``results/<study>``.

    Raises
    ------
    FileNotFoundError
        Where there are none.
    """
    return Results(path)


def compare(a: Results, b: Results, tables: Collection[str] | None = None) -> pd.DataFrame:
    """What differs between two results of the same kind, cell by cell.

    Rows are held together by the keys of their tables. A row that only one side has is told once,
    with ``column`` empty.

    Parameters
    ----------
    tables : those that are compared, which two kinds may have alike; None for all.

    Returns
    -------
    DataFrame
        ``table``, ``key`` (``name=value, ...``), ``column``, ``a``, ``b``, ``difference`` (of
        numbers, b less a); no rows where nothing differs.
    """
    left, right = ([n for n in one if tables is None or n in tables] for one in (a, b))
    told = [row for name in left if name in right for row in _differences(name, a, b)]
    told += [(name, "", "", "only in a", "", np.nan) for name in left if name not in right]
    told += [(name, "", "", "", "only in b", np.nan) for name in right if name not in left]
    return pd.DataFrame(told, columns=["table", "key", "column", "a", "b", "difference"])


def _differences(name: str, a: Results, b: Results) -> Iterator[tuple[object, ...]]:
    key = list(a.kind.table(name).key)
    left, right = (one[name].set_index(key) for one in (a, b))
    for place in left.index.difference(right.index):
        yield name, _words(key, place), "", "only in a", "", np.nan
    for place in right.index.difference(left.index):
        yield name, _words(key, place), "", "", "only in b", np.nan
    both = left.index.intersection(right.index)
    for label in map(str, left.columns.intersection(right.columns)):
        here, there = left.loc[both, label], right.loc[both, label]
        differs = ~((here == there) | (here.isna() & there.isna()))
        is_number, is_flag = pd.api.types.is_numeric_dtype, pd.api.types.is_bool_dtype
        numeric = all(is_number(one) and not is_flag(one) for one in (here, there))
        for place, one, other in zip(both[differs], here[differs], there[differs], strict=True):
            change = other - one if numeric else np.nan
            yield name, _words(key, place), label, one, other, change


def _words(key: list[str], place: object) -> str:
    values = place if isinstance(place, tuple) else (place,)
    return ", ".join(f"{name}={value}" for name, value in zip(key, values, strict=True))
