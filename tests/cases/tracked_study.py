"""A study of tracked motions, its jobs run one after the other in this process."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq

from spinepipe.jobs.collect import join_files
from spinepipe.jobs.expected import Expected, place_of
from spinepipe.marks import read_mark
from spinepipe.studies.read import check
from spinepipe.studies.registry import place_of as place_of_job
from spinepipe.studies.tracking.kind import KIND, TrackingFiles
from spinepipe.tables import arrow_schema, read_frame


@dataclass(frozen=True)
class Run:
    """A study in a folder."""

    root: Path
    name: str = "small"

    @cached_property
    def expected(self) -> Expected:
        """What is expected of it; files of motion are not checked beforehand."""
        return Expected(str(self.root), *check(self.root, self.name, starting=False))

    @property
    def files(self) -> TrackingFiles:
        found = self.expected.files
        assert isinstance(found, TrackingFiles)
        return found

    def path(self, name: str) -> Path:
        return self.root / name

    def job(self, name: str, **arguments: Any) -> None:
        """Run a job; what is written has the mark that is expected of it."""
        module, _, function = place_of_job("tracking", name).partition(":")
        getattr(import_module(module), function)(str(self.root), self.name, **arguments)

    def jobs_of(self, table: str) -> Iterator[tuple[dict[str, str], Path]]:
        """Places and files of the jobs of which a table is made."""
        for block in self.files.blocks(table):
            for file in self.files.job_files(table, *block):
                yield place_of(file), self.path(file)

    def write(self, table: str) -> None:
        """Run all jobs of a table, and of those that come with it, and join them."""
        for place, file in self.jobs_of(table):
            name = self.files.job_of(table, str(file))
            made = self.files.made_of_jobs
            together = [one for one in made if self.files.job_of(one, "") == name]
            here = f"/jobs/{table}/"
            paths = {one: str(file).replace(here, f"/jobs/{one}/") for one in together}
            files: dict[str, Any] = dict(paths) if len(paths) > 1 else {"output": str(file)}
            if name == "track":
                laws = self.files.law_files(place["specimen"], place["trial"], place["approach"])
                files["law"] = [str(self.path(law)) for law in laws]
            self.job(name, **place, **files)
            for path in paths.values():
                assert read_mark(path) == self.expected.of_job(name, place), path

    def join(self, table: str) -> None:
        """Join the job files of a table."""
        inputs = [str(file) for _, file in self.jobs_of(table)]
        marks = {path: self.expected.of_part(table, path) for path in inputs}
        join_files(KIND.table(table), marks, str(self.path_of(table)))

    def analyse(self, name: str) -> None:
        """Run a job that makes a table of tables."""
        job = KIND.job(name)
        tables = [str(self.root / file) for file in self.files.table_files(job.reads)]
        self.job(name, tables=tables, output=str(self.path_of(name)))

    def path_of(self, table: str) -> Path:
        return self.path(f"{self.files.folder}/{table}.parquet")

    def table(self, name: str) -> pd.DataFrame:
        """Rows of a table, whose schema is the declared one."""
        found = pq.read_table(self.path_of(name))
        assert found.schema.remove_metadata() == arrow_schema(KIND.table(name)), name
        return read_frame(self.path_of(name))

    def export(self) -> None:
        """Write what OpenSim reads."""
        folder = self.path(f"{self.files.folder}/opensim")
        for name in self.files.specimens:
            self.job("skeleton", specimen=name, output=str(folder / f"{name}.osim"))
        for place, tracked in self.jobs_of("tracked"):
            specimen, trial, approach = (place[key] for key in ("specimen", "trial", "approach"))
            output = str(folder / specimen / trial / f"{approach}.mot")
            self.job("motion", **place, tracked=str(tracked), output=output)
            assert read_mark(output) == self.expected.of_job("motion", place)
