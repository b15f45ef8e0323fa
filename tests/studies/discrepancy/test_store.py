"""The store of a search's pieces: each is computed once, whatever ends the process in between.

Catches a store that computes twice, believes what is damaged, stale or planted, runs what it reads,
waits for a dead process, comes to something else in workers, or leaves something behind.
"""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sweeps import sweep

from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy import store as store_module
from spinepipe.studies.discrepancy.codec import encode
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.store import MARK, SUFFIX, Store

MODULE = "spinepipe.studies.discrepancy.job"

CALLS: list[Any] = []
"""What was really computed."""


CASE = LoadCase("flexion", 1, ())
WORDS = frozenset({"flexion", "extension", "bending", "rotation"})


def of(*values: float) -> Repeats:
    """Plain data that a piece works on; its mean is a property that is kept once it was asked."""
    return Repeats(CASE, np.reshape(values, (1, 1, 1, len(values))))


@pytest.fixture(autouse=True)
def nothing_computed_yet() -> None:
    CALLS.clear()


def scaled(held: Repeats, factor: float = 2.0, words: frozenset[str] = WORDS) -> Repeats:
    """A piece that counts how often it is computed."""
    CALLS.append(factor)
    return Repeats(held.case, factor * held.cycles)


def test_the_same_content_is_computed_once(tmp_path: Path) -> None:
    for _ in range(2):  # two stores: the second finds what the first has left
        store = Store(tmp_path, MODULE)
        for _ in range(2):
            found = store(scaled, of(1.0, 2.5), 3.0)
            np.testing.assert_array_equal(found.mean.ravel(), [3.0, 7.5])
    assert CALLS == [3.0]


def test_another_argument_function_or_code_is_another_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path, MODULE)
    store(scaled, of(1.0))
    store(scaled, of(1.0 + 1e-15))
    store(scaled, of(1.0), 2.5)
    assert CALLS == [2.0, 2.0, 2.5]
    assert [store(one, [1, 2]) for one in (len, max, min)] == [2, 2, 1]
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


def test_only_data_is_kept_and_pydra_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scratch").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "scratch"))
    Store(tmp_path / "store", MODULE)(scaled, of(1.0))
    (piece,) = (path for path in tmp_path.rglob("*") if path.is_file())
    assert (piece.parent.name, piece.suffix) == ("store", SUFFIX)
    assert piece.read_bytes().startswith(MARK)
    assert piece.read_bytes()[len(MARK) + 65 :] == encode(of(2.0))
    assert list((tmp_path / "scratch").iterdir()) == []


def test_what_is_no_plain_data_is_refused_and_not_kept(tmp_path: Path) -> None:
    """As argument, alone or in an array, and as the result of a piece."""
    for function, argument in ((len, [object()]), (len, [np.array([None])]), (iter, [1])):
        with pytest.raises(TypeError, match="cannot be kept as data"):
            Store(tmp_path, MODULE)(function, argument)
    assert list(tmp_path.iterdir()) == []


def search_of(store: Store, pieces: int, ends_at: int | None = None) -> float:
    """Pieces that each work on what the one before has found, like the rounds of a search."""
    held = of(1.0, 2.0)
    for number in range(pieces):
        assert held.mean.sum() > 0.0  # fills the cached property of what the next piece works on
        if number == ends_at:
            raise KeyboardInterrupt
        held = store(scaled, held, 1.0 + number)
    return float(held.cycles.sum())


def test_a_search_that_was_cut_off_goes_on_where_it_was(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        search_of(Store(tmp_path, MODULE), 6, ends_at=4)
    assert CALLS == [1.0, 2.0, 3.0, 4.0]
    assert search_of(Store(tmp_path, MODULE), 6) == 3.0 * 720.0
    assert CALLS == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert search_of(Store(tmp_path, MODULE), 6) == 3.0 * 720.0
    assert len(CALLS) == 6


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "a flipped bit": lambda whole: whole[:-30] + bytes([whole[-30] ^ 1]) + whole[-29:],
    "cut off": lambda whole: whole[: len(whole) // 2],
    "empty": lambda whole: b"",
    "garbage": lambda whole: b"\x80\x05garbage" * 100,
    "another format": lambda whole: whole.replace(MARK, MARK.replace(b"2", b"1"), 1),
}


def test_a_damaged_piece_counts_as_not_there(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    expected = search_of(Store(tmp_path, MODULE), 2)
    whole = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for damage, (path, content) in product(DAMAGES, whole.items()):
        CALLS.clear()
        caplog.clear()
        path.write_bytes(DAMAGES[damage](content))
        assert search_of(Store(tmp_path, MODULE), 2) == expected
        assert len(CALLS) == 1
        assert [line.split(":")[0] for line in caplog.messages] == [str(path)]
        assert {one: one.read_bytes() for one in tmp_path.iterdir()} == whole


def test_a_store_that_is_a_link_works_and_loses_nothing(tmp_path: Path) -> None:
    """As a link to a faster disk, which other studies may use as well."""
    (tmp_path / "behind").mkdir()
    (tmp_path / "behind" / "thesis.tex").write_text("years of work")
    (tmp_path / "store").symlink_to(tmp_path / "behind")
    Store(tmp_path / "behind", MODULE)(scaled, of(5.0))
    for _ in range(2):
        store = Store(tmp_path / "store", MODULE)
        search_of(store, 2)
        store.forget_the_rest()
    assert CALLS == [2.0, 1.0, 2.0]
    assert len(list((tmp_path / "behind").iterdir())) == 4


def test_a_store_that_was_never_used_has_nothing_to_forget(tmp_path: Path) -> None:
    Store(tmp_path / "none", MODULE).forget_the_rest()
    assert not (tmp_path / "none").exists()


def test_content_is_what_a_value_holds(tmp_path: Path) -> None:
    """Not the properties that it has filled; of a mapping its order, of an array its dtype."""
    store, filled = Store(tmp_path, MODULE), of(1.0, 2.0)
    assert filled.mean.sum() == 3.0
    store(scaled, of(1.0, 2.0))
    store(scaled, filled)
    assert CALLS == [2.0]
    values = [None, 0, 0.0, False, "", (), [], {}, [1, [2]], [[1], 2], {"a": 1, "b": 2}]
    values += [{"b": 2, "a": 1}, np.zeros(2), np.zeros(2, int), np.zeros((2, 1)), np.float64(0.0)]
    for value in values:
        store(str, value)
    assert len(list(tmp_path.iterdir())) == 1 + len(values)


def started(folder: Path, what: str, seed: str = "0") -> subprocess.Popen[str]:
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
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, **places, "PYTHONPATH": paths, "PYTHONHASHSEED": seed},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Its exit code and what it said; one that waits for something for ever fails the test."""
    try:
        said, complained = process.communicate(timeout=300)
    finally:
        process.kill()
    return process.returncode, said.strip(), complained


def test_another_process_finds_the_piece_and_nothing_is_said_or_left(tmp_path: Path) -> None:
    """Sets of words are ordered by the seed of hashing, which differs from process to process."""
    for seed, computed in (("1", "[4.0]"), ("2", "[]")):
        search = "store(scaled, of(1.0), 4.0, WORDS); print(CALLS)"
        assert ended(started(tmp_path, search, seed)) == (0, computed, "")
    outside = [path for path in tmp_path.rglob("*") if "store" not in path.parts]
    assert sorted(path.name for path in outside if path.is_file()) == []
    assert os.environ["NO_ET"] == "1"


def test_a_piece_whose_writing_was_cut_off_is_computed_again(tmp_path: Path) -> None:
    search = "held = store(scaled, of(1.0), 4.0); {}store(scaled, held, 5.0); print(CALLS)"
    dies = "os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL); "
    assert ended(started(tmp_path, search.format(dies)))[0] == -signal.SIGKILL
    names = sorted(path.name for path in (tmp_path / "store").iterdir())
    assert [name.startswith(".") for name in names] == [True, False]
    again = search.format("") + "; store.forget_the_rest()"
    assert ended(started(tmp_path, again)) == (0, "[5.0]", "")
    left = sorted(path.name for path in (tmp_path / "store").iterdir())
    assert len(left) == 2
    assert names[0] not in left


def test_two_runs_at_once_come_to_the_same(tmp_path: Path) -> None:
    """Neither waits for the other; at worst both compute a piece."""
    search = "print(search_of(store, 6))"
    both = [started(tmp_path, search) for _ in range(2)]
    assert [ended(one) for one in both] == [(0, "2160.0", "")] * 2
    assert search_of(Store(tmp_path / "store", MODULE), 6) == 2160.0
    assert CALLS == []


class Trap:
    """Unpickled, it makes a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (str(self._folder),)


PLANTED: dict[str, Callable[[Trap], bytes]] = {
    "a pickle": pickle.dumps,
    "a pickle behind JSON": lambda trap: b'["array","|O",[1],"C",0]\n' + pickle.dumps(trap),
    "no structure": lambda trap: b"PK\5\6" + bytes(18),
}


@sweep("what", PLANTED)
@sweep("sealed", [True, False])
def test_what_somebody_planted_is_not_run_and_computed_again(
    tmp_path: Path, what: str, sealed: bool
) -> None:
    """Bare, and in an envelope that verifies, as anybody can make it who knows the format."""
    CALLS.clear()
    folder, sprung = tmp_path / "store", tmp_path / "sprung"
    Store(folder, MODULE)(scaled, of(1.0))
    (piece,) = folder.iterdir()
    content = PLANTED[what](Trap(sprung))
    if sealed:
        piece.write_bytes(store_module._head(piece, content) + content)
    else:
        piece.write_bytes(content)
    found = Store(folder, MODULE)(scaled, of(1.0))
    assert CALLS == [2.0, 2.0]
    np.testing.assert_array_equal(found.mean.ravel(), [2.0])
    assert not sprung.exists()
    Store(folder, MODULE)(scaled, of(1.0))
    assert CALLS == [2.0, 2.0]  # it was replaced


def test_a_planted_link_is_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "store"
    Store(folder, MODULE)(scaled, of(1.0))
    (piece,) = folder.iterdir()
    piece.rename(tmp_path / "elsewhere")
    piece.symlink_to(tmp_path / "elsewhere")
    Store(folder, MODULE)(scaled, of(1.0))
    assert CALLS == [2.0, 2.0]
    assert not piece.is_symlink()
    assert (tmp_path / "elsewhere").exists()


def test_the_trap_works(tmp_path: Path) -> None:
    """Else the tests above would show nothing."""
    pickle.loads(pickle.dumps(Trap(tmp_path / "sprung")))
    assert (tmp_path / "sprung").is_dir()


@settings(max_examples=100)
@given(st.data())
def test_any_change_of_any_byte_is_seen(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp() / "changed"
    Store(folder, MODULE)(scaled, of(1.0))
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    flipped = bytes([whole[place] ^ (1 << data.draw(st.integers(0, 7)))])
    more = data.draw(st.binary(min_size=1))
    for changed in (whole[:place] + flipped + whole[place + 1 :], whole[:place], whole + more):
        path.write_bytes(changed)
        assert store_module._kept([path]) == {}
    path.write_bytes(whole)
    assert list(store_module._kept([path])) == [path]
    other = path.with_name(sha256(b"other").hexdigest() + SUFFIX)
    path.rename(other)
    assert store_module._kept([other]) == {}  # it is another's result
    other.unlink()


def test_only_pieces_that_nobody_wants_are_swept(tmp_path: Path) -> None:
    store = Store(tmp_path, MODULE)
    store(scaled, of(1.0))
    (wanted,) = tmp_path.iterdir()
    stays = {wanted.name, "notes.txt", "0" * 64, f"{'0' * 63}{SUFFIX}", f".{'0' * 64}{SUFFIX}"}
    for name in stays - {wanted.name}:
        (tmp_path / name).write_text("somebody's work")
    (tmp_path / f"{'1' * 64}{SUFFIX}").write_bytes(b"spinepipe piece 1\nof an older version")
    (tmp_path / f".{'1' * 64}{SUFFIX}.{2**31 - 1}").write_bytes(MARK)
    (tmp_path / f"{'2' * 64}{SUFFIX}").mkdir()
    (tmp_path / f"{'3' * 64}{SUFFIX}").symlink_to(wanted)
    store.forget_the_rest()
    left = {path.name for path in tmp_path.iterdir()}
    assert left == stays | {f"{'2' * 64}{SUFFIX}", f"{'3' * 64}{SUFFIX}"}


def test_what_is_no_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "none")
    for name in ("file", "link"):
        with pytest.raises(NotADirectoryError, match=f"{name} is no folder; remove it"):
            Store(tmp_path / name, MODULE)


def test_a_folder_in_the_place_of_a_piece_fails_no_run(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Store(tmp_path, MODULE)(scaled, of(1.0))
    (path,) = tmp_path.iterdir()
    path.unlink()
    (path / "thesis").mkdir(parents=True)
    assert Store(tmp_path, MODULE)(scaled, of(1.0)).mean.sum() == 2.0
    assert "is not kept: [Errno" in caplog.text
    assert (path / "thesis").exists()


# Workers


def logged(log: str, number: int) -> np.ndarray:
    """A piece that says in a file that it began, and in which process."""
    with Path(log).open("a") as file:
        file.write(f"{number} {os.getpid()}\n")
    if number == int(os.environ.get("SLOW", "-1")):
        time.sleep(600.0)
    if number == int(os.environ.get("DIES", "-1")) and os.getpid() != PARENT:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == int(os.environ.get("FAILS", "-1")):
        raise ArithmeticError(f"piece {number}")
    return np.linalg.qr(np.sin(number + np.arange(4e4)).reshape(200, 200))[0]


PARENT = os.getpid()


def begun(log: Path) -> list[int]:
    """Numbers of the pieces that began, in order of the numbers."""
    lines = log.read_text().splitlines() if log.exists() else []
    return sorted(int(line.split()[0]) for line in lines)


def test_workers_come_to_the_same_bytes_and_leave_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    scratch, log, before = tmp_path / "scratch", tmp_path / "log", os.getcwd()
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    asked = [(str(log), number) for number in (3, 1, 2, 1, 0)]
    found = {n: Store(tmp_path / str(n), MODULE, n).map(logged, asked) for n in (1, 2, 3)}
    for threads in (2, 3):
        for one, other in zip(found[1], found[threads], strict=True):
            assert one.tobytes() == other.tobytes()
        for path in (tmp_path / "1").iterdir():
            assert (tmp_path / str(threads) / path.name).read_bytes() == path.read_bytes()
    assert begun(log) == sorted([0, 1, 2, 3] * 3)
    processes = [line.split()[1] for line in log.read_text().splitlines()]
    assert [one == str(os.getpid()) for one in processes] == [True] * 4 + [False] * 8
    assert Store(tmp_path / "2", MODULE, 2).map(logged, [*asked, (str(log), 9)])[5].shape
    assert log.read_text().split()[-2:] == ["9", str(os.getpid())]  # one alone is computed here
    assert (list(scratch.iterdir()), os.getcwd(), caplog.messages) == ([], before, [])


def test_a_daemon_has_workers_too(tmp_path: Path) -> None:
    """As the jobs of a run are, in the pool of their processes."""
    body = (
        "import multiprocessing\n"
        f"asked = [({str(tmp_path / 'log')!r}, number) for number in range(4)]\n"
        f"store = Store({str(tmp_path / 'store')!r}, MODULE, 2)\n"
        "process = multiprocessing.get_context('fork').Process(\n"
        "    target=store.map, args=(logged, asked), daemon=True)\n"
        "process.start(); process.join(); print(process.exitcode)"
    )
    assert ended(started(tmp_path, body)) == (0, "0", "")
    lines = (tmp_path / "log").read_text().splitlines()
    assert len({line.split()[1] for line in lines}) == 2


def test_what_a_piece_raises_in_a_worker_is_raised_and_the_others_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked = [(str(tmp_path / "log"), number) for number in range(4)]
    monkeypatch.setenv("FAILS", "1")
    with pytest.raises(ArithmeticError, match="piece 1"):
        Store(tmp_path / "store", MODULE, 2).map(logged, asked)
    assert len(list((tmp_path / "store").iterdir())) == 3
    assert caplog.messages == []


def test_a_worker_that_dies_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked = [(str(tmp_path / "log"), number) for number in range(5)]
    monkeypatch.setenv("DIES", "2")
    found = Store(tmp_path / "store", MODULE, 2).map(logged, asked)
    assert [one.shape for one in found] == [(200, 200)] * 5
    assert "a worker failed, what it left is computed without" in caplog.text


def test_a_killed_search_computes_nothing_twice_and_its_workers_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One piece never ends, so that the other worker does the rest; then the search is killed."""
    log, store = tmp_path / "log", tmp_path / "store"
    asked = f"[({str(log)!r}, number) for number in range(5)]"
    monkeypatch.setenv("SLOW", "1")
    search = started(tmp_path, f"store._threads = 2; store.map(logged, {asked})")
    until = time.monotonic() + 300.0
    while time.monotonic() < until and len([*store.glob(f"[!.]*{SUFFIX}")]) < 4:
        time.sleep(0.05)
    workers = {int(line.split()[1]) for line in log.read_text().splitlines()}
    search.kill()
    ended(search)
    while time.monotonic() < until and any(Path(f"/proc/{one}/exe").exists() for one in workers):
        time.sleep(0.05)
    assert not any(Path(f"/proc/{one}/exe").exists() for one in workers)
    monkeypatch.delenv("SLOW")
    assert ended(started(tmp_path, f"store.map(logged, {asked})")) == (0, "", "")
    assert begun(log) == [0, 1, 1, 2, 3, 4]
