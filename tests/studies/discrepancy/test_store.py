"""The store of a search's pieces: each is computed once, whatever ends the process in between."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spinepipe.studies.discrepancy import store as store_module
from spinepipe.studies.discrepancy.store import Store, content_digest

MODULE = "spinepipe.jobs.discrepancy.search"

CALLS: list[Any] = []
"""What was really computed."""


class Side(StrEnum):
    """A choice."""

    LEFT = "left"


@dataclass(frozen=True)
class Held:
    """Plain data that a piece works on."""

    values: np.ndarray
    side: Side = Side.LEFT
    names: frozenset[str] = frozenset({"flexion", "extension", "bending", "rotation"})

    @cached_property
    def total(self) -> float:
        """Filled only where somebody asked for it."""
        return float(self.values.sum())


@pytest.fixture(autouse=True)
def nothing_computed_yet() -> None:
    CALLS.clear()


def scaled(held: Held, factor: float = 2.0) -> Held:
    """A piece that counts how often it is computed."""
    CALLS.append(factor)
    return Held(factor * held.values)


def of(*values: float) -> Held:
    return Held(np.array(values))


def test_the_same_content_is_computed_once(tmp_path: Path) -> None:
    for _ in range(2):  # two stores: the second finds what the first has left
        store = Store(tmp_path, MODULE)
        for _ in range(2):
            found = store(scaled, of(1.0, 2.5), factor=3.0)
            np.testing.assert_array_equal(found.values, [3.0, 7.5])
            assert found.total == 10.5
    assert CALLS == [3.0]


def test_another_argument_function_or_code_is_another_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path, MODULE)
    store(scaled, of(1.0))
    store(scaled, of(1.0 + 1e-15))
    store(scaled, of(1.0), 2.5)
    assert CALLS == [2.0, 2.0, 2.5]
    assert store(len, [1, 2]) == 2
    assert store(max, [1, 2]) == 2
    assert store(min, [1, 2]) == 1
    monkeypatch.setattr(store_module, "code_digest", lambda module: f"changed {module}")
    Store(tmp_path, MODULE)(scaled, of(1.0))
    assert CALLS == [2.0, 2.0, 2.5, 2.0]


def failing(text: str) -> None:
    """A piece that never has a result."""
    CALLS.append(text)
    raise ArithmeticError(text)


def test_what_a_piece_raises_is_passed_on_and_nothing_is_kept(tmp_path: Path) -> None:
    store = Store(tmp_path, MODULE)
    for _ in range(2):
        with pytest.raises(ArithmeticError, match="no pose"):
            store(failing, "no pose")
    assert CALLS == ["no pose", "no pose"]
    assert list(tmp_path.iterdir()) == []


def search_of(store: Store, pieces: int, ends_at: int | None = None) -> float:
    """Pieces that each work on what the one before has found, like the rounds of a search."""
    held = of(1.0, 2.0)
    for number in range(pieces):
        assert held.total > 0.0  # fills the cached property of what the next piece works on
        if number == ends_at:
            raise KeyboardInterrupt
        held = store(scaled, held, 1.0 + number)
    return held.total


def test_a_search_that_was_cut_off_goes_on_where_it_was(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        search_of(Store(tmp_path, MODULE), 6, ends_at=4)
    assert CALLS == [1.0, 2.0, 3.0, 4.0]
    assert search_of(Store(tmp_path, MODULE), 6) == 3.0 * 720.0
    assert CALLS == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert search_of(Store(tmp_path, MODULE), 6) == 3.0 * 720.0
    assert len(CALLS) == 6


def test_pieces_of_other_code_or_data_are_forgotten(tmp_path: Path) -> None:
    Store(tmp_path, MODULE)(scaled, of(5.0))
    store = Store(tmp_path, MODULE)
    search_of(store, 2)
    store.forget_the_rest()
    assert len(list(tmp_path.iterdir())) == 2
    search_of(Store(tmp_path, MODULE), 2)
    assert CALLS == [2.0, 1.0, 2.0]


def test_a_store_that_was_never_used_has_nothing_to_forget(tmp_path: Path) -> None:
    Store(tmp_path / "none", MODULE).forget_the_rest()
    assert not (tmp_path / "none").exists()


def test_content_is_what_a_value_holds() -> None:
    plain, filled = of(1.0, 2.0), of(1.0, 2.0)
    assert filled.total == 3.0
    one, same = "extension", "".join(["exten", "sion"])
    pairs: list[tuple[Any, Any]] = [
        (plain, filled),
        ((plain, plain), (plain, filled)),
        ([one, one], [one, same]),
        (np.arange(6.0).reshape(2, 3).T, np.array([[0.0, 3.0], [1.0, 4.0], [2.0, 5.0]])),
    ]
    for first, second in pairs:
        assert content_digest(first) == content_digest(second)


def test_content_tells_apart() -> None:
    values: list[Any] = [
        None,
        0,
        0.0,
        False,
        "",
        b"",
        "left",
        Side.LEFT,
        (),
        {},
        [1, [2]],
        [[1], 2],
        [1, 2],
        {"a": 1},
        {"a": 1, "b": 2},
        {"b": 2, "a": 1},
        np.zeros(2),
        np.zeros(2, int),
        np.zeros((2, 1)),
        np.float64(0.0),
        of(0.0, 0.0),
        {1, 2},
        len,
        max,
        Held,
        scaled,
    ]
    assert len({content_digest(value) for value in values}) == len(values)


def test_what_cannot_be_told_is_refused(tmp_path: Path) -> None:
    for value in (object(), np.array([None])):
        with pytest.raises(TypeError, match="cannot be told"):
            Store(tmp_path, MODULE)(len, [value])


def process(folder: Path, what: str, seed: str = "0") -> subprocess.CompletedProcess[str]:
    """A process of its own that runs ``what`` with a store in that folder."""
    program = (
        f"import os, signal, sys, test_store\n"
        f"from test_store import *\n"
        f"store = Store({str(folder / 'store')!r}, MODULE)\n"
        f"{what}\n"
    )
    places = {name: str(folder / name) for name in ("HOME", "TMPDIR", "XDG_CACHE_HOME")}
    for place in places.values():
        Path(place).mkdir(exist_ok=True)
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    return subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **places, "PYTHONPATH": paths, "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_another_process_finds_the_piece_and_nothing_is_said_or_left(tmp_path: Path) -> None:
    """Sets of words are ordered by the seed of hashing, which differs from process to process."""
    for seed, computed in (("1", "[4.0]"), ("2", "[]")):
        done = process(tmp_path, "store(scaled, of(1.0), 4.0); print(CALLS)", seed)
        assert (done.returncode, done.stdout.strip(), done.stderr) == (0, computed, "")
    outside = [path for path in tmp_path.rglob("*") if "store" not in path.parts]
    assert sorted(path.name for path in outside if path.is_file()) == []
    assert os.environ["NO_ET"] == "1"


def killed(held: Held) -> Held:
    """A piece in the midst of which the power goes off, the first time."""
    if "DIES" in os.environ:
        os.kill(os.getpid(), signal.SIGKILL)
    return scaled(held, 9.0)


def test_a_killed_process_leaves_nothing_that_one_waits_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = "held = store(scaled, of(1.0), 4.0); store(killed, held); print(CALLS)"
    monkeypatch.setenv("DIES", "1")
    assert process(tmp_path, search).returncode == -signal.SIGKILL
    monkeypatch.delenv("DIES")
    assert process(tmp_path, search).stdout.strip() == "[9.0]"
