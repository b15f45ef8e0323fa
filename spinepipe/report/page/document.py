"""One HTML document, whatever the kind of study: what it is made of, and its template."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from typing import Any

import pandas as pd
import yaml
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from spinepipe.cohort import Cohort
from spinepipe.marks import KEY
from spinepipe.report.page.scene import as_script
from spinepipe.report.page.space import Space, segment
from spinepipe.report.words import count, listed, number
from spinepipe.schema import Column, Table
from spinepipe.studies.study import Study
from spinepipe.tables import StudyTables

_VERSION = "version_"
"""Before the name of a library, in metadata that tell its version."""
_OF_A_TABLE = ("code_digest", "config_digest", "data_digest", "specimens_digest", KEY)
"""Metadata that differ from table to table, and are not told as facts of the whole run."""

MOST_ROWS = 400
"""More rows than this are left to the file of the table."""

_NUMERIC = ("number", "integer")
"""Types of columns that are set as numbers."""

_SAME = ("specimen", "status")
"""Columns that say nothing where all rows have the same value."""

_UNITS: Mapping[str, str] = {
    "see unit": "",
    "mm or deg, see unit": "",
    "N/m or N m/rad, see unit": "",
    "mm2, deg2": "",
}
"""Unit as a table declares it, to that in the heading: none where it differs from row to row."""

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


@dataclass(frozen=True)
class Head:
    """A column's heading.

    Attributes
    ----------
    unit : beside the name, empty where there is none. meaning : shown when it is pointed at.
    numeric : whether its cells are numbers.
    """

    name: str
    unit: str
    meaning: str
    numeric: bool


@dataclass(frozen=True)
class Cell:
    """Text of a cell, and the number it is sorted by: None where it is empty or no number."""

    text: str
    value: float | None


@dataclass(frozen=True)
class Sortable:
    """One table of the page.

    Attributes
    ----------
    name : of the result file, without an ending.
    title, about : above the table: its heading, and what its rows are.
    note : how many rows were left out and where they are, or nothing.
    folded : whether its rows are hidden until a reader asks for them.
    """

    name: str
    title: str
    about: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str
    folded: bool = False


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


@dataclass(frozen=True)
class Origin:
    """What was run: by which code, with which settings and on which data the tables were made.

    Attributes
    ----------
    facts : name and value of what all tables agree on; where they do not, every value.
    digests : of each table its name, the digest (sha256) of the code that made it, and that of the
        settings that it hangs on.
    settings : all settings of the study as YAML.
    """

    facts: tuple[tuple[str, str], ...]
    digests: tuple[tuple[str, str, str], ...]
    settings: str


def origin(study: Study, metadata: Mapping[str, Mapping[str, str]]) -> Origin:
    """What the metadata of all tables say, in alphabetical order; versions of libraries last."""
    settings = yaml.safe_dump(study.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    digests = tuple(
        (name, found.get("code_digest", ""), found.get("config_digest", ""))
        for name, found in sorted(metadata.items())
    )
    return Origin(tuple(_facts(metadata)), digests, settings)


def _facts(metadata: Mapping[str, Mapping[str, str]]) -> list[tuple[str, str]]:
    """See `Origin.facts`."""
    names = sorted({name for found in metadata.values() for name in found})
    plain = [name for name in names if not name.startswith(_VERSION)]
    versions = [name for name in names if name.startswith(_VERSION)]
    facts = []
    for name in [*plain, *versions]:
        # `pandas`: that library's own notes on the columns of a file, which say nothing of a run
        if name in _OF_A_TABLE or name == "pandas":
            continue
        values = sorted({found[name] for found in metadata.values() if name in found})
        label = name.removeprefix(_VERSION) if name in versions else name.replace("_", " ")
        facts.append((label, ", ".join(values)))
    return facts


def sortable(
    name: str,
    title: str,
    about: str,
    frame: pd.DataFrame,
    columns: Sequence[Column],
) -> Sortable:
    """The first `MOST_ROWS` rows of a frame as a table of the page.

    Columns that say nothing are left out: all empty, or the one specimen or status of all rows.
    Where no column is left there are no rows either.

    Parameters
    ----------
    name : of the result file, without an ending; a note on rows left out names it.
    columns : those to be shown, in this order; a frame need not have all of them.
    """
    kept = [c for c in columns if c.name in frame and _says_something(frame[c.name])]
    shown = frame.head(MOST_ROWS)
    note = ""
    if len(frame) > len(shown):
        note = f"The first {len(shown)} of {len(frame)} rows; all of them are in {name}.parquet."
    values = [[_cell(value, c) for value in shown[c.name]] for c in kept]
    heads = tuple(Head(_title(c), _unit(c), _meaning(c), c.type in _NUMERIC) for c in kept)
    return Sortable(name, title, about, heads, tuple(zip(*values, strict=True)), note)


def _unit(column: Column) -> str:
    return _UNITS.get(column.unit, column.unit)


def _meaning(column: Column) -> str:
    empty = f"; empty: {column.empty}" if column.empty else ""
    return f"{column.meaning}{empty}"


def _title(column: Column) -> str:
    """Name without the unit, which stands beside it."""
    name = column.name.removesuffix(f"_{column.unit}") if column.unit else column.name
    return name.replace("_", " ")


def _says_something(values: pd.Series) -> bool:
    if values.name in _SAME and values.nunique() <= 1:
        return False
    return bool((values.notna() & (values != "")).any())


def _cell(value: Any, column: Column) -> Cell:
    """Text by the type of the column: numbers to three significant digits, integers in full."""
    if value is None or (isinstance(value, float) and pd.isna(value)) or value is pd.NA:
        return Cell("", None)
    if column.type == "number":
        return Cell(number(float(value)), float(value))
    if column.type == "integer":
        return Cell(f"{int(value):,}".replace(",", "\u2009"), float(value))
    if column.type == "flag":
        return Cell("yes" if value else "no", None)
    return Cell(str(value), None)


def page_tables(shape: Table, title: str, frame: pd.DataFrame) -> list[Sortable]:
    """A result table as a page has it.

    None without rows; two, see `beside_paper`, of a table ``against_*``, which sets a paper's
    numbers beside ours; else one.

    Parameters
    ----------
    shape : the table as it is declared. frame : its rows.
    """
    if frame.empty:
        return []
    if shape.name.startswith("against_"):
        return beside_paper(shape, title, frame)
    whole = sortable(shape.name, title, shape.about, frame, shape.columns)
    return [whole] if whole.rows else []


_PAPER_ORDER = (
    *("quantity", "unit", "paper", "paper_low", "paper_high", "ours", "ours_low", "ours_high"),
    *("limit", "verdict", "reason", "where", "evidence"),
)
"""Columns of a table ``against_*``: what a reader compares stands first. The key of its rows, a
short name of each quantity, is left to the file.
"""


def beside_paper(shape: Table, title: str, frame: pd.DataFrame) -> list[Sortable]:
    """A paper's numbers beside ours: those that are evidence, then folded those that are none.

    Evidence are those whose column ``evidence`` is ``independent``: the cohort and the study were
    not made to have them, so that agreement could have failed.
    """
    independent = frame["evidence"] == "independent"
    columns = tuple(map(shape.column, _PAPER_ORDER))
    rest = sortable(shape.name, f"{title}: no evidence", NO_EVIDENCE, frame[~independent], columns)
    told = frame[independent].drop(columns="evidence")
    first = sortable(shape.name, title, shape.about, told, columns)
    return [table for table in (first, replace(rest, folded=True)) if table.rows]


NO_EVIDENCE = (
    "Numbers of the paper of which agreement shows nothing: the cohort or the study was made to "
    "have them (circular), they follow from the paper's other numbers (recomputed), these exclude "
    "them (contradicted), or no run has anything to set beside them."
)


def judged(rows: pd.DataFrame) -> str:
    """A sentence on rows of a table ``against_*``; nothing without rows.

    It tells how many quantities that are evidence lie inside the paper's range, outside it, or
    were not computed; how hard it was to lie inside; and, not counted, those that are no evidence.
    """
    if rows.empty:
        return ""
    counted = rows[rows["evidence"] == "independent"]
    inside, outside, lacking = (
        int((counted["verdict"] == name).sum()) for name in ("inside", "outside", "not_computed")
    )
    told = (
        f"Of {len(counted)} published quantities that are evidence ours are inside the paper's "
        f"range for {inside} and outside for {outside}"
        + (f"; {lacking} are not computed" if lacking else "")
    )
    kinds = rows["evidence"].fillna("")
    others = [f"{n} {words}" for kind, words in _NO_EVIDENCE if (n := int((kinds == kind).sum()))]
    rest = f" Not counted: {', '.join(others)}." if others else ""
    return f"{told}.{_what_it_took(counted[counted['verdict'] == 'inside'])}{rest}"


_NO_EVIDENCE = (
    ("circular", "that cohort or study were made to have"),
    ("recomputed", "that follow from the paper's own numbers"),
    ("contradicted", "that other numbers of the paper exclude"),
    ("", "that nothing of a run can be held against"),
)
"""Values of the column ``evidence`` that are none, with the words that follow their number."""

_WORDS_OF_LIMITS = {
    "two_sided": "lie in a range with two ends whose width the paper gives",
    "chosen": "in one whose width was chosen here",
    "wide": "in one so wide (half to twice, or more) that inside is no agreement",
    "one_sided": "are on the right side of a single limit or of zero",
    "binary": "are the same yes, no or count",
}
"""Kinds of range, as in the column ``limit``, in words: that which is hardest to lie in first."""


def _what_it_took(inside: pd.DataFrame) -> str:
    """How many of the rows, all of them inside, lie in ranges of each kind; nothing without rows.

    The strongest kind is told even where its number is 0.
    """
    if inside.empty:
        return ""
    counts = {name: int((inside["limit"] == name).sum()) for name in _WORDS_OF_LIMITS}
    strongest, *weaker = _WORDS_OF_LIMITS
    told = [f"{counts[strongest]} {_WORDS_OF_LIMITS[strongest]}"]
    told += [f"{counts[name]} {_WORDS_OF_LIMITS[name]}" for name in weaker if counts[name]]
    return f" Of the {len(inside)} inside, {', '.join(told)}."
