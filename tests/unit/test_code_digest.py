"""Digests of code: what is kept of files between processes changes none of them."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from spinepipe.jobs import code

MODULE = "spinepipe.jobs.collect"


def forget() -> None:
    """As a new process knows nothing."""
    for known in (code._known, code._file, code._imports, code.closure, code.code_digest):
        known.cache_clear()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    path = tmp_path / "kept.json"
    monkeypatch.setattr(code, "_KEPT", path)
    forget()
    yield path
    forget()


def test_what_was_kept_gives_the_same_digest(kept: Path) -> None:
    fresh = code.code_digest(MODULE)
    code._keep()
    forget()
    assert code._known()
    assert code.code_digest(MODULE) == fresh


def test_a_file_that_has_changed_since_is_read_again(kept: Path) -> None:
    fresh = code.code_digest(MODULE)
    code._keep()
    data = json.loads(kept.read_text("utf-8"))
    for state in data["files"].values():
        state[0][1] += 1
        state[2] = "0" * 64
    kept.write_text(json.dumps(data), "utf-8")
    forget()
    assert code.code_digest(MODULE) == fresh


@pytest.mark.parametrize("content", ["", "{", '{"python": "2.7", "files": {"a": 1}}', "[1]"])
def test_what_cannot_be_read_is_not_believed(kept: Path, content: str) -> None:
    fresh = code.code_digest(MODULE)
    kept.write_text(content, "utf-8")
    forget()
    assert code.code_digest(MODULE) == fresh


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ('"""Doc."""\nx = 1  # why\n', "x = 1\n", True),
        ("def f():\n    '''Doc.'''\n    return 1\n", "def f():\n\n    return 1\n", True),
        ("x = 1\n", "x = 2\n", False),
        ("x = 'text'\n", "x = 'other'\n", False),
        ("from spinepipe import units\n", "from spinepipe import files\n", False),
    ],
)
def test_only_meaning_counts(tmp_path: Path, one: str, other: str, same: bool) -> None:
    files = [tmp_path / "one.py", tmp_path / "other.py"]
    for path, text in zip(files, (one, other), strict=True):
        path.write_text(text, "utf-8")
    first, second = (code._read("spinepipe.made_up", path) for path in files)
    assert (first == second) is same
