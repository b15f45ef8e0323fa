"""Sweeps run every case and fail with all that fail.

Catches a sweep that passes though a case fails, stops at the first, or has no cases.
"""

from pathlib import Path

import pytest
from sweeps import one_of_each, sweep


def test_all_cases_that_fail_are_told() -> None:
    seen = []

    @sweep("number, word", [(1, "a"), pytest.param(2, "b", id="two"), (3, "c")])
    def odd(number: int, word: str) -> None:
        seen.append((number, word))
        assert number == 2

    with pytest.raises(ExceptionGroup, match="2 of 3 cases fail") as told:
        odd()
    assert seen == [(1, "a"), (2, "b"), (3, "c")]
    notes = [fault.__notes__ for fault in told.value.exceptions]
    assert notes == [["case 1: 1, 'a'"], ["case 3: 3, 'c'"]]


def test_a_case_that_is_skipped_hides_no_other() -> None:
    @sweep("number", range(3))
    def lacking(number: int) -> None:
        if number == 0:
            pytest.skip("not here")
        assert number < top

    top = 2
    with pytest.raises(ExceptionGroup, match="1 of 3"):
        lacking()
    top = 3
    with pytest.raises(pytest.skip.Exception, match="not here"):
        lacking()


def test_no_cases_are_no_sweep() -> None:
    with pytest.raises(AssertionError, match="no cases"):
        sweep("number", lambda: iter(()))(lambda number: None)()


@sweep("outer", "ab")
@sweep("inner", (1, 2))
def test_each_case_of_two_sweeps_has_a_folder_of_its_own(
    outer: str, inner: int, tmp_path: Path
) -> None:
    assert not list(tmp_path.iterdir())
    (tmp_path / outer).write_text(str(inner))


def test_one_place_of_each_form() -> None:
    places = [{"coordinate": place, "law": law} for law in "de" for place in "xyz"]
    found = one_of_each(places, lambda options: ("name", options))
    assert [one["law"] for one in found] == ["d", "e"]
    assert found[0]["coordinate"] != found[1]["coordinate"]
