"""Which files the results of a study consist of, whatever its kind.

Job files are joined block by block before they become one table: a flat fan-in of thousands of
files costs Snakemake quadratic time.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from spinepipe.cohort import Cohort
from spinepipe.studies.study import Study

MOST_FILES_PER_BLOCK = 300
"""Job files that are made and joined as one block."""

LEAST_BLOCKS = 16
"""Blocks of a table, where it has as many job files: they keep several cores at work."""


@dataclass(frozen=True)
class Figure:
    """A figure of a study.

    Attributes
    ----------
    name : of its files.
    title : above it on the report's page.
    at : ``file:function`` in the folder of the kind; called with study, cohort and tables.
    reads : the tables it is drawn from; a name with a dot is another result file.
    also : tables that it shows besides, where the study has them.
    """

    name: str
    title: str
    at: str
    reads: tuple[str, ...]
    also: tuple[str, ...] = ()

    @property
    def tables(self) -> tuple[str, ...]:
        """Those of ``reads`` that are tables."""
        return tuple(name for name in self.reads if "." not in name)


@dataclass(frozen=True)
class StudyFiles(ABC):
    """The result files of one study, as paths relative to the working directory.

    Attributes
    ----------
    study
        The study.
    specimens
        Names of the specimens of its cohort.
    """

    drawings: ClassVar[tuple[Figure, ...]] = ()
    """Figures of this kind of study, in the order of the report."""

    joined: ClassVar[tuple[str, ...]] = ()
    """Tables that studies of this kind join from job files."""

    full: ClassVar[tuple[str, ...]] = ()
    """Tables that `full` alone makes, with the figures drawn from them and a page, full.html."""

    told_in_report: ClassVar[tuple[str, ...]] = ()
    """Files other than tables and figures that the report reads."""

    subfolder: ClassVar[str] = ""
    """Where all results but pages are, below the folder of the study; ends with a slash."""

    study: Study
    specimens: tuple[str, ...]

    @classmethod
    @abstractmethod
    def of(cls, study: Any, cohort: Cohort) -> Self:
        """The files of a study of a cohort."""

    @property
    def folder(self) -> str:
        """Where all results of the study but its pages are."""
        return f"results/{self.study.study}/{self.subfolder}".rstrip("/")

    def page(self, name: str = "report") -> str:
        """The file of a page, in the same place for every kind."""
        return f"results/{self.study.study}/{name}.html"

    @property
    @abstractmethod
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables of this study that are made of job files, block by block."""
        return ()

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        raise ValueError(f"{table} is not made of job files")

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        raise ValueError(f"{table} is not made of job files")

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        raise ValueError(f"{table} is not made of job files")

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """Tables of this study with one job file per specimen, joined without blocks."""
        return ()

    @property
    def others(self) -> tuple[str, ...]:
        """Results that are neither tables nor figures nor the report."""
        return ()

    def tables_of(self, full: bool) -> tuple[str, ...]:
        """The tables that this study has, with those of `full` or without."""
        return tuple(name for name in self.tables if full or name not in self.full)

    def figures(self, full: bool = True) -> tuple[str, ...]:
        """The figures that this study has, with those of `full` or without."""
        tables = set(self.tables_of(full))
        return tuple(drawing.name for drawing in self.drawings if set(drawing.tables) <= tables)

    @property
    def adds(self) -> tuple[str, ...]:
        """The tables that `full` adds to this study."""
        return tuple(name for name in self.tables if name in self.full)

    def table_files(self, names: tuple[str, ...], full: bool = True) -> list[str]:
        """Files of tables, of those that the study has, with those of `full` or without."""
        return [f"{self.folder}/{name}.parquet" for name in names if name in self.tables_of(full)]

    def other_files(self, names: tuple[str, ...]) -> dict[str, str]:
        """Files that are no tables (a name with a dot), by their names without the ending."""
        return {name.partition(".")[0]: f"{self.folder}/{name}" for name in names if "." in name}

    def read_by_figure(self, name: str) -> list[str]:
        """What a figure is drawn from: of what it names, what the study has."""
        figure = self.figure(name)
        full = bool(set(figure.tables) & set(self.full))
        return self.has((*figure.reads, *figure.also), full)

    def has(self, names: Sequence[str], full: bool) -> list[str]:
        """Of these results those that the study has, tables first; a name with a dot is none."""
        tables = [name for name in names if name in self.tables_of(full)]
        return tables + [name for name in names if "." in name]

    def figure(self, name: str) -> Figure:
        """The figure of that name."""
        return next(drawing for drawing in self.drawings if drawing.name == name)

    def block_files(self, table: str) -> list[str]:
        """The files of which a table is made."""
        if table in self.by_specimen:
            return [self.specimen_file(table, name) for name in self.specimens]
        return [self.block_file(table, *block) for block in self.blocks(table)]

    def block_file(self, table: str, specimen: str, block: str) -> str:
        """The file of one block of a table."""
        return f"{self.folder}/blocks/{table}/specimen-{specimen}/block-{block}.parquet"

    def specimen_file(self, table: str, specimen: str) -> str:
        """The job file of a specimen, of a table that has one for each."""
        return f"{self.folder}/{table}/specimen-{specimen}.parquet"

    def results(self, full: bool = False) -> list[str]:
        """What a reader of the study wants to have: report, tables, figures and the rest."""
        files = [*(f"{table}.parquet" for table in self.tables_of(full)), *self.others]
        drawn = self.figures(full)
        files += [f"figures/{figure}.{kind}" for figure in drawn for kind in ("svg", "png")]
        pages = ["report", *(["full"] if full and self.adds else [])]
        return [*(f"{self.folder}/{file}" for file in files), *map(self.page, pages)]

    def lost(self, full: bool = False) -> list[str]:
        """Job files that are missing although a table or block holds their rows.

        Snakemake does not miss a deleted file once the table made of it exists.
        """
        tables = self.tables_of(full)
        whole = {name: os.path.exists(f"{self.folder}/{name}.parquet") for name in tables}
        lost = [
            file
            for table in self.made_of_jobs
            if table in tables
            for specimen, block in self.blocks(table)
            if whole[table] or os.path.exists(self.block_file(table, specimen, block))
            for file in self.job_files(table, specimen, block)
            if not os.path.exists(file)
        ]
        return lost + [
            file
            for table in self.by_specimen
            if table in tables and whole[table]
            for file in self.block_files(table)
            if not os.path.exists(file)
        ]

    def every(self) -> list[str]:
        """All files that the study makes: results, those of `full` too, blocks, job files."""
        files = self.results(full=True)
        for table in self.by_specimen:
            files += self.block_files(table)
        for table in self.made_of_jobs:
            files += self.block_files(table)
            for specimen, block in self.blocks(table):
                files += self.job_files(table, specimen, block)
        return files


def numbered_blocks(specimens: Sequence[str], files: int) -> list[tuple[str, str]]:
    """(specimen, block) of a table with so many job files of each specimen."""
    count = -(-files // _per_block(len(specimens), files))
    return [(name, f"{block:03d}") for name in specimens for block in range(count)]


def files_of_block(block: str, specimens: int, files: int) -> range:
    """Numbers of the job files of a block, of so many of the specimen."""
    size = _per_block(specimens, files)
    return range(int(block) * size, min((int(block) + 1) * size, files))


def _per_block(specimens: int, files: int) -> int:
    """Job files of a block: some, but not so many that cores have nothing to do at the end."""
    return min(MOST_FILES_PER_BLOCK, max(1, -(-specimens * files // LEAST_BLOCKS)))
