"""The generated parts of the documentation, each between two markers in a page.

A page says where a part goes:

    <!-- generated: table poses -->
    <!-- end of generated -->

What stands between the markers is written by `spinepipe docs` and compared in the tests.
"""

import re
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from spinepipe.cohort import columns as cohort_columns
from spinepipe.cohort.header import CohortHeader
from spinepipe.model.file import ModelFile
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.report.effects_reference import effects
from spinepipe.report.keys import key_table
from spinepipe.report.markdown import code, table
from spinepipe.studies import KINDS, Selection
from spinepipe.tables import TABLES
from spinepipe.tables.schema import Column, Table

DOCS = "docs"
END = "<!-- end of generated -->"
_PART = re.compile(rf"<!-- generated: (.+?) -->\n.*?{re.escape(END)}", re.DOTALL)


@cache
def generators() -> dict[str, Callable[[], str]]:
    """Every part that can be generated, by the name that pages use."""
    parts: dict[str, Callable[[], str]] = {"effects": effects}
    parts |= {f"table {name}": partial(result_table, shape) for name, shape in TABLES.items()}
    parts |= {
        f"cohort {name}": partial(cohort_table, form)
        for name, form in cohort_columns.TABLES.items()
    }
    parts["keys cohort.yaml"] = partial(key_table, CohortHeader)
    parts["keys config.yaml"] = partial(key_table, Selection)
    parts["keys model"] = partial(key_table, ModelFile)
    parts |= {f"keys {kind}": partial(key_table, model) for kind, model in KINDS.items()}
    return parts


def result_table(shape: Table) -> str:
    """Columns of a result table."""
    rows = [
        (code(c.name), c.kind, c.unit, _range(c), c.meaning, c.null or "never empty")
        for c in shape.columns
    ]
    key = ", ".join(code(name) for name in shape.key)
    head = ("column", "type", "unit", "range", "meaning", "an empty cell means")
    return f"{shape.about}\n\nUnique by {key}.\n\n{table(head, rows)}"


def _range(column: Column) -> str:
    if column.allowed:
        return ", ".join(code(str(value)) for value in column.allowed)
    ends = [
        words.format(f"{end:g}")
        for words, end in (("at least {}", column.low), ("at most {}", column.high))
        if end is not None
    ]
    return " and ".join(ends)


def cohort_table(form: cohort_columns.TableForm) -> str:
    """Columns of a CSV file of a cohort."""
    rows = [
        (
            f"**{code(c.name)}**" if c.required else code(c.name),
            c.kind,
            c.range_text,
            c.meaning,
            "not allowed" if c.required else "allowed",
        )
        for c in form.columns
    ]
    keys = ", ".join(code(name) for name in form.keys)
    more = " Further columns are carried through as text." if form.carries else ""
    head = ("column", "type", "range", "meaning", "an empty cell")
    return f"One row per {form.row}; unique by {keys}.{more}\n\n{table(head, rows)}"


def refreshed(text: str, page: str) -> str:
    """A page with all its generated parts as they should be.

    Raises
    ------
    InputError
        For a marker that names nothing known, or one without an end.
    """
    if text.count("<!-- generated: ") != len(_PART.findall(text)):
        problem = Problem(page, None, None, "a marker without an end", END, "add it")
        raise InputError([problem])
    return _PART.sub(lambda found: _part(found[1], page), text)


def _part(name: str, page: str) -> str:
    known = generators()
    if name not in known:
        remedy = did_you_mean(name, known, "correct the marker")
        raise InputError([Problem(page, None, None, f"'{name}'", one_of(known), remedy)])
    return f"<!-- generated: {name} -->\n\n{known[name]()}\n\n{END}"


def pages(root: Path) -> list[Path]:
    """All pages of the documentation."""
    return sorted((root / DOCS).rglob("*.md"))


def outdated(root: Path) -> list[Path]:
    """Pages whose generated parts differ from what the code says."""
    texts = ((path, path.read_text(encoding="utf-8")) for path in pages(root))
    return [path for path, text in texts if refreshed(text, path.name) != text]


def names_in(text: str) -> list[str]:
    """Names of the generated parts of a page."""
    return [found[1] for found in _PART.finditer(text)]
