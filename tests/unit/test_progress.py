"""What long work says of itself.

Catches work that says nothing, or too much, of itself.
"""

import itertools

import pytest

from spinepipe import progress


def test_long_rounds_say_how_far_they_are_and_what_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = itertools.count(0.0, 4.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    lines: list[str] = []
    told = progress.Progress(lines.append)
    assert list(told.through("abcd", "refits")) == list("abcd")
    assert lines[0].startswith("refits, 1 of 4 done, about ")
    assert lines[0].endswith(" s left")


def test_short_rounds_say_nothing_more() -> None:
    lines: list[str] = []
    told = progress.Progress(lines.append)
    told.round("round 1")
    assert list(told.through([1, 2, 3], "refits")) == [1, 2, 3]
    assert lines == ["round 1"]
