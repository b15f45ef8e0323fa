"""One HTML document, whatever the kind of study: what it is made of, and its template."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files

import pandas as pd
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from spinepipe.cohort import Cohort
from spinepipe.report.page.origin import origin
from spinepipe.report.page.scene import as_script
from spinepipe.report.page.space import Space, segment
from spinepipe.report.page.tables import (
    Sortable,
)
from spinepipe.report.words import count, listed
from spinepipe.studies.study import Study
from spinepipe.tables import StudyTables

_MOST_NAMES = 12
"""Specimens that the head of the page names; of more it tells how many."""


CIRCULAR = (
    "Circular: this cohort is made up, nobody was measured. What was put into it comes out again. "
    "What follows tests the method and is no evidence about people."
)
"""What stands above all findings of a made-up cohort."""


@dataclass(frozen=True)
class Headline:
    """The answer in one sentence, how sure it is, and what casts doubt on it."""

    words: str
    how_sure: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Picture:
    """One figure.

    Attributes
    ----------
    name : of its file, without an ending.
    address : the drawing itself, as a ``data:`` address (base64).
    """

    name: str
    title: str
    address: str
    caption: str

    @classmethod
    def of(cls, name: str, title: str, svg: str, caption: str) -> "Picture":
        """A figure inside the page: as an image of its own it shares no ids with the others."""
        return cls(name, title, _address(svg.encode()), caption)


@dataclass(frozen=True, eq=False)
class ResultTables:
    """Results of one study, each by its name.

    Attributes
    ----------
    tables : rows of each table that the page reads (its ``READ``); in ``tables.files`` paths of
        other result files.
    metadata : what each table's file says of where it comes from.
    pictures : each figure with its title and caption, in the order of the report.
    """

    tables: StudyTables
    metadata: Mapping[str, Mapping[str, str]]
    pictures: Mapping[str, Picture]

    def table(self, name: str) -> pd.DataFrame:
        """Rows of a table; a frame without rows or columns where it was not made, or not read."""
        return self.tables.get(name, pd.DataFrame())


@dataclass(frozen=True, eq=False)
class Document:
    """What differs between reports.

    Attributes
    ----------
    question : what the study asks, below the title.
    findings : sentences, the most urgent first.
    pictures, tables : in the order of the page.
    metadata : what each table's file says of where it comes from, by the table's name.
    left_out : parts that the settings leave out, in words.
    poses : rows of the table ``poses``, sampled joint frames for the 3-D view; none where nothing
        was sampled. A cohort that does not tell where joints are has no 3-D view.
    with_loads : whether the 3-D view shows the loads of the cohort: not where others were applied.
    tests : those whose loads the 3-D view shows; None for all of the cohort.
    load_shift_mm : by how much the study moves all load points: anterior, superior, right.
    headline : the answer, where the study asks for one; figures then come before the 3-D view.
    space : another 3-D view in the place of that of the specimens, to which ``poses``,
        ``with_loads``, ``tests`` and ``load_shift_mm`` belong; None for that one.
    """

    question: str
    findings: Sequence[str]
    pictures: Sequence[Picture]
    tables: Sequence[Sortable]
    metadata: Mapping[str, Mapping[str, str]]
    left_out: Sequence[str]
    poses: pd.DataFrame = field(default_factory=pd.DataFrame)
    with_loads: bool = True
    tests: Sequence[str] | None = None
    load_shift_mm: Sequence[float] = (0.0, 0.0, 0.0)
    headline: Headline | None = None
    space: Space | None = None

    def html(self, study: Study, cohort: Cohort) -> str:
        """The page. It loads nothing from the network, and the same results make the same bytes."""
        environment = Environment(
            autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
        )
        template = environment.from_string(_part("page.html"))
        space = self.space
        if space is None:
            shown = (self.poses, self.with_loads, self.tests, self.load_shift_mm)
            space = segment(cohort, *shown)
        return template.render(
            study=study,
            cohort=cohort,
            question=self.question,
            headline=self.headline,
            specimens=_specimens(cohort),
            circular=CIRCULAR if cohort.made_up else "",
            findings=self.findings,
            pictures=self.pictures,
            tables=self.tables,
            origin=origin(study, self.metadata),
            left_out=self.left_out,
            space=space,
            still=_address(space.still),
            scenes=Markup(as_script(space.as_data())),  # nothing in it could end the element
            style=Markup(_part("page.css")),
            script=Markup(_part("page.js.html")),
            plotly=Markup(get_plotlyjs()) if space.scenes else "",
        )


def _part(name: str) -> str:
    """Text of a file that lies beside this one."""
    return files("spinepipe.report.page").joinpath(name).read_text(encoding="utf-8")


def _specimens(cohort: Cohort) -> str:
    names = cohort.specimen_names
    return f"{count(len(names), 'specimen')}: {listed(names, _MOST_NAMES, last=None)}"


def _address(svg: bytes) -> str:
    """A drawing as an address that holds it."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
