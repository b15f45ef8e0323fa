"""The mark that each result file of a study must have, see `spinepipe.marks`.

A job writes the mark of what it read; here is told beforehand what that will be.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.jobs.collect import joined_digest
from spinepipe.jobs.digest import digest_of
from spinepipe.jobs.inputs import ranked_set
from spinepipe.jobs.layouts import files_of
from spinepipe.jobs.model_mark import base_marks
from spinepipe.jobs.study_files import StudyFiles
from spinepipe.studies.base_model import made_by
from spinepipe.studies.read import check
from spinepipe.studies.study import Study

Place = Mapping[str, str]
"""Wildcards of a job: specimen, pose and what else its files' names say."""

HEADER_ALONE = {"start_model", "range_of_motion.draw_stiffness", "global_sensitivity.design"}
"""Jobs that read no specimen."""

MAKES_MODEL = {"joint_pose_sensitivity": "start_model", "discrepancy": "discrepancy.search"}
"""Job that writes the model files of a kind of study."""

WITH_BASE = {
    "discrepancy.search",
    *(f"cohort_stiffness.{job}" for job in ("fit", "literature", "left_out", "pool")),
}
"""Jobs that read the model file that a study builds on."""


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
    def _known(self) -> dict[Any, str]:
        return {}

    def of_job(self, job: str, place: Place) -> str:
        """The mark of the files of a job."""
        others = self._others(job, place)
        specimens = self._specimens(job, place)
        key = job, specimens, tuple(others)
        if key not in self._known:
            self._known[key] = digest_of(job, self.study, self.cohort, specimens, others)
        return self._known[key]

    def of_part(self, table: str, path: str) -> str:
        """The mark of a file that is joined with others: a job file or a block of a table."""
        place = place_of(path)
        if "block" in place and "/blocks/" in path:
            return self.of_block(table, place["specimen"], place["block"])
        return self.of_job(self.files.job_of(table, path), place)

    def of_block(self, table: str, specimen: str, block: str) -> str:
        """The mark of a block of a table."""
        return self._joined(table, self.files.job_files(table, specimen, block))

    def of_table(self, table: str) -> str:
        """The mark of a table that is joined from job files."""
        return self._joined(table, self.files.block_files(table))

    def _joined(self, table: str, parts: Sequence[str]) -> str:
        return joined_digest(parts, [self.of_part(table, part) for part in parts])

    def _specimens(self, job: str, place: Place) -> tuple[str, ...] | None:
        if job in HEADER_ALONE:
            return ()
        if "specimen" not in place:
            return None
        return (place["specimen"],)

    def _others(self, job: str, place: Place) -> list[str]:
        """What else a job reads that decides, as the job itself names it."""
        study: Any = self.study
        base = self._base if job in WITH_BASE else []
        if job == "cohort_stiffness.left_out":
            where = (place[name] for name in ("specimen", "representation", "fitted_to"))
            fits = self.files.fits_of_others(*where)  # type: ignore[attr-defined]
            return [*base, *(self.of_part("stiffness", fit) for fit in fits)]
        if job in ("global_sensitivity.respond", "global_sensitivity.calibrate"):
            return [str(study.batch_size(len(self.files.specimens)))]
        if job == "simulate" and place["stiffness"] != "calibrated":
            return [self._ranked(place["specimen"], place["stiffness"])]
        return base

    def _ranked(self, specimen: str, stiffness: str) -> str:
        best = Path(self.root, self.files.folder, "best.json")
        return ranked_set(str(best), specimen, stiffness) if best.is_file() else ""

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
            if path in other.models:
                return [other.of_job(MAKES_MODEL[other.study.kind], {})]
        return base_marks(self.root, study.base.model)

    @property
    def models(self) -> list[Path]:
        """The model files that the study makes."""
        names = [name for name in self.files.others if name.endswith(".yaml")]
        return [Path(self.root, self.files.folder, name) for name in names]


def place_of(path: str) -> dict[str, str]:
    """The ``name=value`` parts of a path, its suffix left out."""
    parts = path.removesuffix(".parquet").split("/")
    return dict(part.split("=", 1) for part in parts if "=" in part)
