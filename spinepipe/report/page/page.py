"""The page itself: what goes into its template."""

import base64
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from spinepipe.cohort import Cohort
from spinepipe.report.page.captions import caption
from spinepipe.report.page.findings import findings
from spinepipe.report.page.origin import left_out, origin
from spinepipe.report.page.results import Results
from spinepipe.report.page.scene import GROUPS, MOST_POSES, as_script, scenes
from spinepipe.report.page.tables import SHOWN, shown_tables
from spinepipe.report.specimen import draw_specimen
from spinepipe.report.specimen_view import view_of
from spinepipe.report.style import picture, style
from spinepipe.report.words import count
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

_MOST_NAMES = 12


@dataclass(frozen=True)
class Picture:
    """One figure: its name, title, address as data, and caption."""

    name: str
    title: str
    address: str
    caption: str


def study_page(study: JointPoseSensitivity, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_part("page.html"))
    drawn = scenes(study, cohort, results.table("poses"))
    return template.render(
        study=study,
        cohort=cohort,
        question=QUESTION,
        specimens=_specimens(cohort),
        findings=findings(study, results),
        pictures=[_picture(name, study, cohort, results) for name in results.pictures],
        tables=shown_tables(study, results),
        origin=origin(study, results.metadata),
        left_out=left_out(study),
        drawn=list(drawn),
        still=_address(_still(study, cohort)),
        groups=GROUPS,
        most_poses=MOST_POSES,
        scenes=Markup(as_script(drawn)),  # as_script leaves nothing that could end the element
        style=Markup(_part("page.css")),
        script=Markup(_part("page.js.html")),
        plotly=Markup(get_plotlyjs()),
    )


def _part(name: str) -> str:
    return files("spinepipe.report.page").joinpath(name).read_text(encoding="utf-8")


def _specimens(cohort: Cohort) -> str:
    names = cohort.specimen_names
    shown = ", ".join(names[:_MOST_NAMES])
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return f"{count(len(names), 'specimen')}: {shown}{more}"


def _picture(name: str, study: JointPoseSensitivity, cohort: Cohort, results: Results) -> Picture:
    """A figure inside the page: as an image of its own it shares no ids with the others."""
    title = TITLES.get(name, name.replace("_", " "))
    address = _address(results.pictures[name].encode())
    words = caption(name, results.captions[name], study, cohort, results)
    return Picture(name, title, address, words)


def _still(study: JointPoseSensitivity, cohort: Cohort) -> bytes:
    """The first specimen as a drawing, for paper and for readers without scripts."""
    with style():
        return picture(
            draw_specimen(cohort, view_of(cohort, cohort.specimen_names[0], study)), "svg"
        )


def _address(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
