"""The page of a study, whatever its kind: made of conclusions, drawings and tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files

import pandas as pd
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import spinepipe
from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Sentence, Told, told
from spinepipe.report.forms.chart import Drawing
from spinepipe.report.page.origin import origin
from spinepipe.report.page.tables import Sortable
from spinepipe.report.viewer.figure import viewer_html, viewer_script, viewer_style
from spinepipe.report.viewer.scene import Scene
from spinepipe.report.viewer.specimens import specimen_scenes
from spinepipe.report.words import count, listed
from spinepipe.studies.study import Study
from spinepipe.tables import StudyTables

_HERE = "spinepipe.report.page"

MOST_FINDINGS = 5
"""Of those that have something to say the first; all others stand folded."""

MOST_KEYS = 4

_MOST_NAMES = 6
"""Specimens that the head of the page names; of more it tells how many."""

LEVELS = {"stop": "stop", "check": "check", "ok": "fine"}
"""Of lights, the worst first, with the word that follows their number."""

SIGNS = {"stop": "■", "check": "▲", "ok": "●"}
"""Of lights, told apart without colour too."""


@dataclass(frozen=True, eq=False)
class ResultTables:
    """Results of one study, as its page reads them.

    Attributes
    ----------
    tables : rows of each table that the page reads (its ``READ``); in ``tables.files`` paths of
        other result files.
    metadata : what each table's file says of where it comes from.
    drawings : each figure, by its name.
    """

    tables: StudyTables
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    drawings: Mapping[str, Drawing] = field(default_factory=dict)

    def table(self, name: str) -> pd.DataFrame:
        """Rows of a table; a frame without rows or columns where it was not made, or not read."""
        return self.tables.get(name, pd.DataFrame())


@dataclass(frozen=True, eq=False)
class Page:
    """What differs between pages of studies.

    Attributes
    ----------
    conclusions : what the kind's rules came to. sentences : the kind's table of sentences.
    key_figure : beside the answer, by name; nothing where there is none to show it.
    tables : folded below; those of a paper's comparison are not among them.
    left_out : parts that the settings leave out, in words.
    scenes : of the 3-D view; None for the specimens of the cohort with its loads.
    chooser : what a scene is one of.
    """

    conclusions: Sequence[Conclusion]
    sentences: Sequence[Sentence]
    key_figure: str
    tables: Sequence[Sortable]
    left_out: Sequence[str] = ()
    scenes: Sequence[Scene] | None = None
    chooser: str = "Specimen"

    @cached_property
    def told(self) -> list[Told]:
        """All conclusions in words, in the order of the page."""
        return told(self.conclusions, self.sentences)

    def at(self, place: str) -> list[Told]:
        """Those of a place."""
        return [one for one in self.told if one.place == place]

    def html(
        self,
        study: Study,
        cohort: Cohort,
        results: ResultTables,
        *,
        papers: Mapping[str, str] | None = None,
        folder: str = "",
    ) -> str:
        """The page. It loads nothing from the network; the same results make the same bytes.

        Parameters
        ----------
        papers : pages of comparisons with papers, by file, with the words of the link.
        folder : of tables and figures as the page reaches it, with a slash.
        """
        findings, lights = self.at("finding"), self.at("light")
        drawings = dict(results.drawings)
        key_figure = drawings.pop(self.key_figure, None)
        used = {one.figure for one in findings[:MOST_FINDINGS]}
        counts = [
            (level, words, sum(one.level == level for one in lights))
            for level, words in LEVELS.items()
        ]
        scenes = specimen_scenes(cohort) if self.scenes is None else self.scenes
        run = origin(study, results.metadata)
        shown = {
            "tag": tag(cohort.made_up, cohort.rebuilt),
            "data": f"{cohort.title} · {_specimens(cohort)}",
            "study": study.study,
            "answer": self.at("answer")[0],
            "key_numbers": [_key(one) for one in self.at("key")[:MOST_KEYS]],
            "depends": self.at("depends"),
            "key_figure": key_figure,
            "findings": findings[:MOST_FINDINGS],
            "first": {one.figure: n for n, one in reversed([*enumerate(findings, 1)])},
            "others": findings[MOST_FINDINGS:],
            "drawings": drawings,
            "further": [one for name, one in drawings.items() if name not in used],
            "lights": sorted(lights, key=lambda one: list(LEVELS).index(one.level)),
            "counts": [one for one in counts if one[2]],
            "viewer": viewer_html(scenes, self.chooser),
            "tables": self.tables,
            "methods": self.at("methods"),
            "origin": run,
            "folder": folder,
            "left_out": self.left_out,
            "source": cohort.source,
            "papers": (papers or {}).items(),
            "version": spinepipe.__version__,
            "cite": f"spinepipe {spinepipe.__version__}, study {study.study} ({study.kind}) of the "
            f"cohort {cohort.name}. Data: {cohort.source}",
        }
        title = f"{study.study}: {self.at('answer')[0].text}"
        return rendered("study_page.html", page=shown, title=title, index="../index.html")


def rendered(template: str, packages: Sequence[str] = (), **values: object) -> str:
    """A template of this folder, or of further packages, in the frame that all pages share."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name, "") for name in (_HERE, *packages)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["SIGNS"] = SIGNS
    style, script = (
        files(_HERE).joinpath(f"study_page.{end}").read_text("utf-8") for end in ("css", "js")
    )
    return environment.get_template(template).render(
        style=Markup(style) + viewer_style(),
        script=Markup(script) + viewer_script(),
        **values,
    )


def tag(made_up: bool, rebuilt: bool) -> str:
    """Where the data of a cohort come from, in a word or two."""
    return "Simulated data" if made_up else "Rebuilt from print" if rebuilt else "Measured data"


def _specimens(cohort: Cohort) -> str:
    names = cohort.specimen_names
    few = f": {listed(names, last=None)}" if len(names) <= _MOST_NAMES else ""
    return f"{count(len(names), 'specimen')}{few}"


def _key(one: Told) -> dict[str, str]:
    """A key number: the value of that name in large type, its interval below it."""
    value = one.values["value"]
    return {
        "number": f"{value:unit}",
        "interval": f"{value:interval}",
        "text": one.text,
        "note": one.note,
    }
