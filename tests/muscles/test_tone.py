"""The least tone: where it is looked for, how near it is found, and when there is none."""

from types import SimpleNamespace
from typing import Any

import pytest

from spinepipe.muscles import co_contraction
from spinepipe.muscles.co_contraction import CoContraction, least_stable
from spinepipe.status import Balanced


class Tried:
    """Postures that stand from a tone on, and are beyond strength from another on."""

    def __init__(self, stands_from: float, held_below: float = 1.0) -> None:
        self.stands_from, self.held_below = stands_from, held_below
        self.tones: list[float] = []

    def toned(self, person: Any, task: Any, how: Any, gain: float, share: float) -> CoContraction:
        assert (person, task, how, gain) == ("person", "task", "how", 10.0)
        self.tones.append(share)
        holds = share < self.held_below
        status = Balanced.CONVERGED if holds else Balanced.BEYOND_STRENGTH
        held: Any = SimpleNamespace(status=status)
        return CoContraction(held, share, share - self.stands_from)


def found(monkeypatch: pytest.MonkeyPatch, tried: Tried) -> CoContraction | None:
    monkeypatch.setattr(co_contraction, "toned", tried.toned)
    person: Any = "person"
    task: Any = "task"
    how: Any = "how"
    return least_stable(person, task, how, 10.0)


@pytest.mark.parametrize("least", [0.0004, 0.00126, 0.0071, 0.0499, 0.0501, 0.1, 0.159, 0.161, 0.2])
def test_the_least_tone_is_found_to_a_sixtieth(
    monkeypatch: pytest.MonkeyPatch, least: float
) -> None:
    tried = Tried(least)
    best = found(monkeypatch, tried)
    assert best is not None
    assert best.stands
    assert least <= best.tone <= least + max(least, 0.00125) / 64.0 * (1.0 + 1e-12)
    # doubled from 0.125 %, then halved six times: each posture costs seconds
    doubled = [0.0, 0.00125]
    while doubled[-1] < least:
        doubled.append(min(2.0 * doubled[-1], 0.2))
    assert tried.tones[: len(doubled)] == pytest.approx(doubled)
    assert len(tried.tones) == len(doubled) + 6


def test_what_stands_by_itself_needs_none(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = Tried(0.0)  # an eigenvalue of nought does not fall over
    best = found(monkeypatch, tried)
    assert best is not None
    assert (best.tone, tried.tones) == (0.0, [0.0])


def test_beyond_a_fifth_it_is_not_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = Tried(0.2001)
    assert found(monkeypatch, tried) is None
    assert max(tried.tones) == 0.2


@pytest.mark.parametrize("held_below", [0.001, 0.01])
def test_a_tone_that_strength_has_not_left_ends_the_search(
    monkeypatch: pytest.MonkeyPatch, held_below: float
) -> None:
    tried = Tried(0.05, held_below)
    assert found(monkeypatch, tried) is None
    assert tried.tones[-2] < held_below <= tried.tones[-1] + 0.00125


def test_a_posture_that_cannot_be_held_does_not_stand() -> None:
    held: Any = SimpleNamespace(status=Balanced.BEYOND_STRENGTH)
    assert not CoContraction(held, 0.1, 1.0).stands
    held = SimpleNamespace(status=Balanced.CONVERGED)
    assert CoContraction(held, 0.1, 0.0).stands
    assert not CoContraction(held, 0.1, -1e-9).stands
