"""The kind joint_count."""

from dataclasses import dataclass

from spinepipe.studies.joint_count.settings import JointCount

from spinepipe.cohort import Cohort
from spinepipe.schema import all_declared
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.study_files import Figure, StudyFiles


@dataclass(frozen=True)
class JointCountFiles(StudyFiles):
    """The result files of one study."""

    joined = ("joints",)
    full = ("shares",)
    drawings = (Figure("joint_bars", "Joints", "charts:bars", ("joints",)),)

    study: JointCount

    @classmethod
    def of(cls, study: JointCount, cohort: Cohort) -> "JointCountFiles":
        """The files of a study of a cohort."""
        return cls(study, cohort.specimen_names)

    @property
    def tables(self) -> tuple[str, ...]:
        """All tables."""
        return ("joints", "totals", "shares")

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """One job file per specimen."""
        return self.joined

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file."""
        return "count"


KIND = Kind(
    settings=JointCount,
    files=JointCountFiles,
    checks=(),
    tables=all_declared(__file__),
    jobs=(
        Job("count", ignores=ignoring("shown")),
        Job("totals", "totals", ("joints",), ("totals",), ignoring("shown")),
        Job("shares", "shares", ("joints",), ("shares",), ignoring("shown")),
    ),
)
