"""Job: the joints of one specimen."""

from spinepipe.studies.joint_count.settings import JointCount
from spinepipe.studies.joint_count.tables import JOINTS

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.tables import from_rows, write


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write one row."""
    settings, cohort = study_of_kind(JointCount, root, study)
    row = {"specimen": specimen, "joints": settings.times * len(cohort.joint_names)}
    write(from_rows(JOINTS, [row]), output, provenance("count", settings, cohort, [specimen]))
