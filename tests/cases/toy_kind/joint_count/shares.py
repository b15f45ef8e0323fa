"""Job of `full`: the share that each specimen has of the joints of all."""

from spinepipe.studies.joint_count.settings import JointCount
from spinepipe.studies.joint_count.tables import SHARES

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write one row per specimen from ``joints``."""
    settings, cohort = study_of_kind(JointCount, root, study)
    joints = read_frames(tables)["joints"]
    shares = joints["joints"] / joints["joints"].sum()
    rows = [
        {"specimen": specimen, "share": share}
        for specimen, share in zip(joints["specimen"], shares, strict=True)
    ]
    write(from_rows(SHARES, rows), output, provenance("shares", settings, cohort))
