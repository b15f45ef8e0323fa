"""Rows of `facts.csv`: every number has a source or says that it has none, and is read."""

import ast
import csv
import re
from pathlib import Path

import pytest

from spinepipe import facts
from spinepipe.effects import registered

PACKAGE = Path(facts.__file__).parent
FILES = sorted(PACKAGE.rglob(facts.FILE))
COLUMNS = ["fact", "of", "values", "unit", "status", "source", "doi", "place", "note"]
NAME = re.compile(r"[a-z]+(_[a-z]+)+")
"""As digests look for them."""


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as text:
        lines = csv.DictReader(text)
        assert lines.fieldnames == COLUMNS
        return list(lines)


def asked(folder: Path) -> set[str]:
    """Facts that modules of a folder ask for; each is written out, beside its own `__name__`."""
    found = set()
    for path in folder.glob("*.py"):
        text = path.read_text("utf-8")
        if f"from {facts.__name__} import" not in text:
            continue
        tree = ast.parse(text)
        readers = {
            alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.module == facts.__name__
            for alias in node.names
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in readers:
                module, fact = node.args
                assert isinstance(module, ast.Name), path
                assert module.id == "__name__", path
                assert isinstance(fact, ast.Constant), path
                found.add(fact.value)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_every_number_has_a_source_or_says_that_it_has_none(path: Path) -> None:
    found = rows(path)
    for row in found:
        assert row["values"].split(), row
        assert [float(value) for value in row["values"].split()], row
        assert row["unit"], row
        assert row["status"] in facts.STATUSES, row
        assert row["source"], row
        assert (row["status"] == "choice") == (row["source"] == "own estimate"), row
        assert row["place"] or row["status"] in ("choice", "from_memory"), row
        assert re.fullmatch(r"(10\.\d{4,}/\S+)?", row["doi"]), row
        assert NAME.fullmatch(row["fact"]), row
        assert row["fact"] not in registered(), row
    keys = [(row["fact"], row["of"]) for row in found]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_every_row_is_read_beside_it_and_nothing_else(path: Path) -> None:
    assert {row["fact"] for row in rows(path)} == asked(path.parent)


def test_facts_are_asked_for_where_there_is_a_file() -> None:
    folders = {path.parent for path in PACKAGE.rglob("*.py")}
    assert {folder for folder in folders if asked(folder)} == {path.parent for path in FILES}


def test_one_number_several_and_none() -> None:
    module = "spinepipe.muscles.disc_pressure"
    assert facts.number(module, "diaphragm_ahead") == 0.05
    assert facts.numbers(module, "disc_pressure_range") == {
        "nominal_pressure": 1.86,
        "flexion": 10.0,
    }
    assert facts.several(module, "stiffening_by_preload")["low"] == (250.0, 1.71)
    with pytest.raises(ValueError, match="unpack"):
        facts.numbers(module, "stiffening_by_preload")
    with pytest.raises(KeyError, match="no_such_fact"):
        facts.number(module, "no_such_fact")
