"""The kind range_of_motion: how far spines of known geometry move in tests that nobody did."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.schema import all_declared
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.range_of_motion.settings import RangeOfMotion, check_range_of_motion
from spinepipe.studies.study_files import Figure, StudyFiles, files_of_block, numbered_blocks

BY_SPECIMEN = ("frames",)
"""Tables joined from one file per specimen."""

OF_JOBS = ("range_of_motion",)
"""Tables joined from job files, one for each specimen, pose and stiffness set."""

TABLES = (*BY_SPECIMEN, "stiffness_sets", *OF_JOBS, "rom_summary", "rom_variance")


@dataclass(frozen=True)
class RangeOfMotionFiles(StudyFiles):
    """The result files of one range-of-motion study."""

    joined = (*OF_JOBS, *BY_SPECIMEN)
    drawings = (
        Figure("range_of_motion", "Range of motion", "charts:motion", ("rom_summary",)),
        Figure(
            "rom_variance",
            "Where the variance comes from",
            "charts:shares",
            ("rom_variance",),
        ),
    )

    study: RangeOfMotion

    @classmethod
    def of(cls, study: RangeOfMotion, cohort: Cohort) -> "RangeOfMotionFiles":
        """The files of a study of a cohort."""
        return cls(study, cohort.specimen_names)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that every study has."""
        return TABLES

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The table that is made of job files."""
        return OF_JOBS

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """The drawn frames."""
        return BY_SPECIMEN

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return "sample_frames" if table in BY_SPECIMEN else "simulate"

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of the table, blocks numbered `000`, `001`, ..."""
        return numbered_blocks(self.specimens, self._per_specimen)

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        files = []
        for number in files_of_block(block, len(self.specimens), self._per_specimen):
            pose, stiffness = divmod(number, self.study.stiffness_sets)
            place = f"specimen-{specimen}/pose-{pose:04d}/stiffness-{stiffness:02d}"
            files.append(f"{self.folder}/jobs/{place}.parquet")
        return files

    @property
    def _per_specimen(self) -> int:
        """Number of job files of a specimen."""
        return self.study.n_poses * self.study.stiffness_sets


def _drawn(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The marks of what is drawn: joint frames and stiffness sets."""
    return [expected.of_job(job, place) for job in ("sample_frames", "draw_stiffness")]


_MOVING = ("virtual_tests", "tests", "rows", "damping")
_SETS = ("stiffness", "level_stiffness", "stiffness_sets", "stiffness_spread")
_FRAMES = ("poses", "pose_sd")
"""Settings by what they decide: the tests, the stiffness sets, the joint frames."""

KIND = Kind(
    question="How far do the joints move?",
    cost="10 poses, a run of each test",
    starter="poses: 10\n"
    "pose_sd: {translation_mm: 1.0, rotation_deg: 3.0}  # of joint frames, as from landmarks\n",
    settings=RangeOfMotion,
    files=RangeOfMotionFiles,
    checks=(check_range_of_motion,),
    tables=all_declared(__file__),
    jobs=(
        Job("sample_frames", at="draw:sample_frames", ignores=ignoring(*_MOVING, *_SETS)),
        Job(
            "draw_stiffness",
            at="draw:draw_stiffness",
            makes=("stiffness_sets",),
            ignores=ignoring(*_MOVING, *_FRAMES),
            header_alone=True,
        ),
        Job(
            "simulate",
            in_blocks="range_of_motion",
            ignores=ignoring("seed", *_SETS, *_FRAMES),
            also=_drawn,
        ),
        Job("rom_summary", "summary", ("range_of_motion",), ("rom_summary",)),
        Job("rom_variance", "variance", ("range_of_motion",), ("rom_variance",)),
    ),
    exports="export:exported",
)
