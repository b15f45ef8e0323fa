"""One HTML document, whatever the kind of study: what goes into the template."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files

import pandas as pd
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from spinepipe.cohort import Cohort
from spinepipe.report.page.origin import origin
from spinepipe.report.page.scene import MOST_POSES, as_script, groups_of, scenes
from spinepipe.report.page.sortable import Sortable
from spinepipe.report.specimen import draw_specimen
from spinepipe.report.specimen_view import SpecimenView, view_of
from spinepipe.report.style import picture, style
from spinepipe.report.words import count
from spinepipe.studies import JointPoseSensitivity, Study

_MOST_NAMES, _MOST_SHOWN = 12, 6


@dataclass(frozen=True)
class Picture:
    """One figure: its name, title, address as data, and caption."""

    name: str
    title: str
    address: str
    caption: str

    @classmethod
    def of(cls, name: str, title: str, svg: str, caption: str) -> "Picture":
        """A figure inside the page: as an image of its own it shares no ids with the others."""
        return cls(name, title, _address(svg.encode()), caption)


@dataclass(frozen=True)
class Headline:
    """The answer in one sentence, how sure it is, and what casts doubt on it."""

    words: str
    how_sure: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Document:
    """What differs between reports.

    Attributes
    ----------
    findings : sentences, the most urgent first. left_out : parts that the settings leave out.
    poses : rows of the table ``poses`` for the 3-D view; none where nothing was sampled.
    metadata : what each table's file says of where it comes from.
    with_loads : whether the 3-D view shows the loads of the cohort: not where others were applied.
    headline : the answer, where the study asks for one; figures then come before the 3-D view.
    """

    question: str
    findings: Sequence[str]
    pictures: Sequence[Picture]
    tables: Sequence[Sortable]
    metadata: Mapping[str, Mapping[str, str]]
    left_out: Sequence[str]
    poses: pd.DataFrame
    with_loads: bool = True
    headline: Headline | None = None

    def html(self, study: Study, cohort: Cohort) -> str:
        """The document, which fetches nothing; the same results, the same bytes."""
        environment = Environment(
            autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
        )
        template = environment.from_string(_part("page.html"))
        views = self._views(study, cohort)
        drawn = scenes(views, cohort, self.poses)
        return template.render(
            study=study,
            cohort=cohort,
            question=self.question,
            headline=self.headline,
            specimens=_specimens(cohort),
            findings=self.findings,
            pictures=self.pictures,
            tables=self.tables,
            origin=origin(study, self.metadata),
            left_out=self.left_out,
            drawn=list(drawn),
            still=_address(_still(views[0], cohort)),
            groups=groups_of(drawn),
            most_poses=MOST_POSES,
            scenes=Markup(as_script(drawn)),  # as_script leaves nothing that could end the element
            style=Markup(_part("page.css")),
            script=Markup(_part("page.js.html")),
            plotly=Markup(get_plotlyjs()),
        )

    def _views(self, study: Study, cohort: Cohort) -> list[SpecimenView]:
        """What is shown of each of the first specimens."""
        shifted = study if isinstance(study, JointPoseSensitivity) else None
        views = [view_of(cohort, name, shifted) for name in cohort.specimen_names[:_MOST_SHOWN]]
        return views if self.with_loads else [replace(v, cases=(), motions=()) for v in views]


def _part(name: str) -> str:
    return files("spinepipe.report.page").joinpath(name).read_text(encoding="utf-8")


def _specimens(cohort: Cohort) -> str:
    names = cohort.specimen_names
    shown = ", ".join(names[:_MOST_NAMES])
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return f"{count(len(names), 'specimen')}: {shown}{more}"


def _still(view: SpecimenView, cohort: Cohort) -> bytes:
    """A specimen as a drawing, for paper and for readers without scripts."""
    with style():
        return picture(draw_specimen(cohort, view), "svg")


def _address(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
