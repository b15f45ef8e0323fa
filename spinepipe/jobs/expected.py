"""The mark that each result file of a study must have, see `spinepipe.marks`.

A job writes the mark of what it read; here is told beforehand what that will be.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.jobs.collect import joined_digest
from spinepipe.jobs.digest import base_marks, digest_of, figure_digest, report_digest
from spinepipe.marks import mark_in
from spinepipe.studies.base_model import made_by
from spinepipe.studies.kind import Job
from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of, kind_of
from spinepipe.studies.study import Study
from spinepipe.studies.study_files import StudyFiles

_PART = re.compile(r"([a-z_]+)-(.+)")

Place = Mapping[str, str]
"""Wildcards of a job: specimen, pose and what else its files' names say."""


@dataclass(frozen=True, eq=False)
class Expected:
    """The marks of all files of one study, each worked out once; paths as in its `StudyFiles`."""

    root: str
    study: Study
    cohort: Cohort

    @cached_property
    def files(self) -> StudyFiles:
        """Names of the files."""
        return files_of(self.study, self.cohort)

    @cached_property
    def _known(self) -> dict[tuple[str, ...], str]:
        return {}

    def _once(self, key: tuple[str, ...], made: Callable[[], str]) -> str:
        if key not in self._known:
            self._known[key] = made()
        return self._known[key]

    def of_job(self, job: str, place: Place) -> str:
        """The mark of the files of a job."""
        declared = kind_of(self.study.kind).job(job)
        others = self._others(declared, place)
        specimens = self._specimens(declared, place)
        key = job, str(specimens), *others
        return self._once(key, lambda: digest_of(job, self.study, self.cohort, specimens, others))

    def of_part(self, table: str, path: str) -> str:
        """The mark of a file that is joined with others: a job file or a block of a table."""
        place = place_of(path)
        if "block" in place and "/blocks/" in path:
            return self.of_block(table, place["specimen"], place["block"])
        return self.of_job(self.files.job_of(table, path), place)

    def of_block(self, table: str, specimen: str, block: str) -> str:
        """The mark of a block of a table."""
        files = self.files
        key = "block", table, specimen, block
        return self._once(key, lambda: self._joined(table, files.job_files(table, specimen, block)))

    def of_table(self, table: str) -> str:
        """The mark of a table that is joined from job files."""
        files = self.files
        return self._once(("table", table), lambda: self._joined(table, files.block_files(table)))

    def _joined(self, table: str, parts: Sequence[str]) -> str:
        shape = kind_of(self.study.kind).table(table)
        return joined_digest(shape, parts, [self.of_part(table, part) for part in parts])

    def of_result(self, name: str) -> str:
        """The mark of a table, or of another result by its name with a dot."""
        if name in (*self.files.made_of_jobs, *self.files.by_specimen):
            return self.of_table(name)
        kind, place = kind_of(self.study.kind), {}
        # a job may make many results of one pattern, such as `{specimen}.osim`: which place is it?
        for pattern in (made for job in kind.jobs for made in job.makes if "{" in made):
            form = re.sub(r"\\\{(\w+)\\\}", r"(?P<\1>[^/]+)", re.escape(pattern))
            if found := re.fullmatch(form, name):
                name, place = pattern, found.groupdict()
        return self.of_job(kind.maker(name).name, place)

    def of_file(self, path: str) -> str:
        """The mark of a file that a reader wants to have, one of `StudyFiles.results`."""
        name = path.removeprefix(f"{self.files.folder}/")
        if name.startswith("figures/"):
            return self.of_figure(Path(name).stem)
        if name.endswith(".html"):
            return self.of_report(Path(name).stem)
        return self.of_result(name.removesuffix(".parquet"))

    @property
    def is_up_to_date(self) -> bool:
        """Whether settings, data and code of now make the report that is there, so all it shows.

        Its mark covers the marks of all tables and figures; that these are whole is not asked.
        """
        there = all(Path(self.root, path).exists() for path in self.files.results())
        return there and mark_in(Path(self.root, self.files.page())) == self.of_report("report")

    def _of_results(self, names: Sequence[str], full: bool) -> list[str]:
        return [self.of_result(name) for name in self.files.has(names, full)]

    def of_figure(self, name: str) -> str:
        """The mark of a figure."""
        read = [self.of_result(one) for one in self.files.read_by_figure(name)]
        return self._once(
            ("figure", name), lambda: figure_digest(name, self.study, self.cohort, read)
        )

    def of_report(self, page: str) -> str:
        """The mark of a page: `report`, or `full`."""
        files, full = self.files, page == "full"
        drawn = files.figures(full)
        read = [
            *self._of_results(files.tables, full),
            *map(self.of_figure, drawn),
            *self._of_results(files.told_in_report, full),
        ]
        return report_digest(page, self.study, self.cohort, read)

    def _specimens(self, job: Job, place: Place) -> tuple[str, ...] | None:
        if job.header_alone:
            return ()
        if "specimen" not in place:
            return None
        return (place["specimen"],)

    def _others(self, job: Job, place: Place) -> list[str]:
        """What else a job reads that decides, as the job itself names it."""
        base = self._base if job.reads_base else []
        also = job.also(self, place) if job.also else []
        full = bool(job.writes) and set(job.writes) <= set(self.files.full)
        return [*base, *also, *self._of_results(job.reads, full)]

    @cached_property
    def _base(self) -> list[str]:
        """The mark of the model file that the study builds on, also if it is yet to be made."""
        study: Any = self.study
        if study.base is None or study.base.model is None:
            return []
        root = Path(self.root)
        path = root / study.base.model
        maker = made_by(path, root)
        if maker is not None:
            other = Expected(self.root, *check(root, maker, starting=False))
            job = kind_of(other.study.kind).makes_models
            if job is not None and path in other.models:
                return [other.of_job(job, {})]
        return base_marks(self.root, study.base.model)

    @property
    def models(self) -> list[Path]:
        """The model files that the study makes."""
        names = [name for name in self.files.others if name.endswith(".yaml")]
        return [Path(self.root, self.files.folder, name) for name in names]


def place_of(path: str) -> dict[str, str]:
    """The ``name-value`` parts of a path, its suffix left out.

    With ``=`` in place of ``-`` readers of folders would make columns of them, of numbers where
    values are of digits (docs/decisions/0063).
    """
    parts = map(_PART.fullmatch, path.removesuffix(".parquet").split("/"))
    return {part[1]: part[2] for part in parts if part}
