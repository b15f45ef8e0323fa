"""Job: the joints of all specimens."""

from spinepipe.studies.joint_count.settings import JointCount
from spinepipe.studies.joint_count.tables import TOTALS

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write one row from ``joints``."""
    settings, cohort = study_of_kind(JointCount, root, study)
    total = int(read_frames(tables)["joints"]["joints"].sum())
    origin = provenance("totals", settings, cohort)
    write(from_rows(TOTALS, [{"joints": total}]), output, origin)
