"""The report of a joint-pose study."""

from spinepipe.cohort import Cohort
from spinepipe.report.page.captions import caption
from spinepipe.report.page.document import Document, Picture
from spinepipe.report.page.findings import findings
from spinepipe.report.page.origin import left_out
from spinepipe.report.page.results import Results
from spinepipe.report.page.tables import SHOWN, shown_tables
from spinepipe.studies import JointPoseSensitivity

QUESTION = (
    "How stiff are the intervertebral joints of this cohort, and how much of the answer hangs on "
    "where its landmarks were palpated?"
)
TITLES = {
    "stiffness": "Calibrated stiffness",
    "errors": "Errors of predicted motion",
    "joint_pose": "Joint frames from uncertain landmarks",
    "bootstrap": "Start values, damping and loading",
    "success_by_method": "Success by method",
    "agreement": "Agreement with measured motion",
    "pose_against_stiffness": "Joint pose against stiffness",
    "landmark_precision": "Landmark precision needed",
}
READ = ("poses", "calibrations", "success", "method_fits", *SHOWN)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def study_page(study: JointPoseSensitivity, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    whole = Document(
        question=QUESTION,
        findings=findings(study, results),
        pictures=[_picture(name, study, cohort, results) for name in results.pictures],
        tables=shown_tables(study, results),
        metadata=results.metadata,
        left_out=left_out(study),
        poses=results.table("poses"),
    )
    return whole.html(study, cohort)


def _picture(name: str, study: JointPoseSensitivity, cohort: Cohort, results: Results) -> Picture:
    """A figure with its caption as it holds for this study."""
    words = caption(name, results.captions[name], study, cohort, results)
    return Picture.of(name, TITLES.get(name, name.replace("_", " ")), results.pictures[name], words)
