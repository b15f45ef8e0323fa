"""Searches in lockstep: each gets its own answers, round by round; trouble ends all of them.

Catches a search that gets the answers of another, and trouble that is swallowed.
"""

import threading
from collections.abc import Callable, Sequence
from functools import partial

import pytest

from spinepipe.calibration.lockstep import in_lockstep

Ask = Callable[[int], int]


def doubling(first: int, rounds: int, ask: Ask) -> list[int]:
    """Asks for the double of what it was told last."""
    told = [first]
    for _ in range(rounds):
        told.append(ask(told[-1]))
    return told


def test_every_search_gets_its_own_answers_in_rounds_of_those_that_wait() -> None:
    rounds = []

    def answers(asked: Sequence[tuple[int, int]]) -> list[int]:
        rounds.append(list(asked))
        return [2 * question for _, question in asked]

    searches = [partial(doubling, 1, 3), partial(doubling, 5, 1), partial(doubling, 7, 0)]
    found = in_lockstep(searches, answers)
    assert found == [[1, 2, 4, 8], [5, 10], [7]]
    assert rounds == [[(0, 1), (1, 5)], [(0, 2)], [(0, 4)]]


def test_one_search_alone_is_the_same() -> None:
    assert in_lockstep([partial(doubling, 3, 2)], lambda asked: [q + 1 for _, q in asked]) == [
        [3, 4, 5]
    ]


def failing(ask: Ask) -> int:
    ask(1)
    raise ArithmeticError("no way on")


@pytest.mark.parametrize("others", [0, 2])
def test_what_a_search_raises_is_raised_and_the_others_end(others: int) -> None:
    before = threading.active_count()
    searches = [*[partial(doubling, 1, 5)] * others, failing]
    with pytest.raises(ArithmeticError, match="no way on"):
        in_lockstep(searches, lambda asked: [0 for _ in asked])
    assert threading.active_count() == before


def test_trouble_with_the_answers_is_raised() -> None:
    before = threading.active_count()

    def answers(asked: Sequence[tuple[int, int]]) -> list[int]:
        raise RuntimeError("nobody knows")

    with pytest.raises(RuntimeError, match="nobody knows"):
        in_lockstep([partial(doubling, 1, 5)] * 3, answers)
    assert threading.active_count() == before
