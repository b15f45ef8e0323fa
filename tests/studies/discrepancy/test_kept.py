"""Results in a folder: only what was written comes back, only what was written here is deleted."""

import logging
import os
import stat
from hashlib import sha256
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinepipe.studies.discrepancy.kept import MARK, SUFFIX, Kept

ONE, OTHER = (sha256(word).hexdigest() for word in (b"one", b"other"))
DATA = bytes(range(256)) * 4


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    """A folder that holds one piece."""
    found = Kept(tmp_path / "store")
    found.write(ONE, DATA)
    return found


@pytest.fixture
def path(kept: Kept, tmp_path: Path) -> Path:
    """The piece's file."""
    return tmp_path / "store" / f"{ONE}{SUFFIX}"


def test_what_was_written_is_read(kept: Kept, path: Path) -> None:
    assert kept.read(ONE) == DATA
    assert Kept(path.parent).read(ONE) == DATA
    assert kept.read(OTHER) is None
    assert os.listdir(path.parent) == [path.name]


def test_nothing_is_made_by_looking(tmp_path: Path) -> None:
    empty = Kept(tmp_path / "none")
    assert empty.read(ONE) is None
    empty.sweep(())
    assert os.listdir(tmp_path) == []


@settings(max_examples=200)
@given(st.data())
def test_any_change_of_any_byte_is_seen(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    kept = Kept(tmp_path_factory.getbasetemp() / "changed")
    kept.write(ONE, DATA)
    path = tmp_path_factory.getbasetemp() / "changed" / f"{ONE}{SUFFIX}"
    whole = path.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    flipped = whole[place] ^ (1 << data.draw(st.integers(0, 7)))
    changed = (
        whole[:place] + bytes([flipped]) + whole[place + 1 :],
        whole[:place],
        whole[:place] + b"\0" * (len(whole) - place),
        whole + data.draw(st.binary(min_size=1)),
    )
    for content in changed:
        path.write_bytes(content)
        assert content == whole or kept.read(ONE) is None


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "does not begin as a piece"),
        (b"garbage", "does not begin as a piece"),
        (b"spinepipe piece 0\n" + DATA, "does not begin as a piece of this version"),
        (MARK, "not those that were written"),
        (MARK + b"0" * 64 + b"\n" + DATA, "not those that were written"),
    ],
)
def test_what_does_not_verify_is_said_in_one_line_and_replaced(
    kept: Kept, path: Path, caplog: pytest.LogCaptureFixture, content: bytes, why: str
) -> None:
    path.write_bytes(content)
    assert kept.read(ONE) is None
    (line,) = caplog.messages
    assert line.startswith(f"{path}: ")
    assert why in line
    assert "\n" not in line
    assert line.endswith("computed again and replaced")
    kept.write(ONE, DATA)
    assert kept.read(ONE) == DATA


def test_a_file_under_another_token_is_not_its_result(
    kept: Kept, path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path.rename(path.with_name(f"{OTHER}{SUFFIX}"))
    assert kept.read(OTHER) is None
    assert "not those that were written" in caplog.text


def test_only_pieces_that_nobody_wants_are_swept(kept: Kept, path: Path) -> None:
    kept.write(OTHER, DATA)
    kept.sweep({ONE})
    assert os.listdir(path.parent) == [path.name]
    kept.sweep({OTHER})
    assert os.listdir(path.parent) == []


def test_pieces_of_other_versions_and_of_killed_runs_are_swept(kept: Kept, path: Path) -> None:
    folder = path.parent
    (folder / f"{OTHER}{SUFFIX}").write_bytes(b"spinepipe piece 17\nwhatever")
    for number, content in enumerate((b"", MARK[:5], MARK + b"cut")):
        (folder / f".{ONE}{SUFFIX}.{4000 + number}").write_bytes(content)
    kept.sweep({ONE})
    assert os.listdir(folder) == [path.name]


def test_what_others_put_there_stays(kept: Kept, path: Path) -> None:
    folder = path.parent
    foreign = {
        "notes.txt",
        f"{OTHER}{SUFFIX}",
        OTHER,
        f"{OTHER}.npz",
        f"{OTHER[1:]}{SUFFIX}",
        f".{OTHER}{SUFFIX}",
        f".{OTHER}{SUFFIX}.1",
    }
    for name in foreign:
        (folder / name).write_text("somebody's work")
    (folder / "data").mkdir()
    (folder / "data" / f"{OTHER}{SUFFIX}").write_bytes(MARK)
    (folder / sha256(b"folder").hexdigest()).mkdir()
    (folder / sha256(b"folder").hexdigest() / "thesis.tex").write_text("years of work")
    before = sorted(folder.rglob("*"))
    kept.sweep({ONE})
    assert sorted(folder.rglob("*")) == before


def test_folders_of_pickles_are_removed_unread(kept: Kept, path: Path) -> None:
    """As the store was before: a folder per token, in which pydra wrote; here with its lock."""
    for token in (ONE, OTHER):
        (path.parent / token / "hashes").mkdir(parents=True)
        (path.parent / token / "python-0a1b").mkdir()
        (path.parent / token / "python-0a1b" / "_result.pklz").write_bytes(b"cos\nabort\n(tR.")
        (path.parent / token / "python-0a1b.lock").write_text("of a host that is gone")
    kept.sweep({ONE})
    assert os.listdir(path.parent) == [path.name]


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A folder of somebody else, full of what would be swept in a store."""
    folder = tmp_path / "elsewhere"
    Kept(folder).write(OTHER, DATA)
    (folder / OTHER / "hashes").mkdir(parents=True)
    (folder / "thesis.tex").write_text("years of work")
    return folder


def test_links_in_the_folder_are_neither_followed_nor_deleted(
    kept: Kept, path: Path, elsewhere: Path
) -> None:
    folder, there = path.parent, elsewhere / f"{OTHER}{SUFFIX}"
    links = {f"{OTHER}{SUFFIX}": there, OTHER: elsewhere, f".{OTHER}{SUFFIX}.7": there}
    for name, target in links.items():
        (folder / name).symlink_to(target)
    old = folder / sha256(b"old").hexdigest()
    old.mkdir()
    (old / "hashes").symlink_to(elsewhere)
    before = {one: one.lstat().st_mode for one in (*elsewhere.rglob("*"), *folder.rglob("*"))}
    assert kept.read(OTHER) is None  # though it would verify
    kept.sweep({ONE})
    after = {one: one.lstat().st_mode for one in (*elsewhere.rglob("*"), *folder.rglob("*"))}
    assert after == before


def test_a_result_takes_the_place_of_a_link_and_not_of_what_it_leads_to(
    kept: Kept, path: Path, elsewhere: Path
) -> None:
    path.unlink()
    path.symlink_to(elsewhere / "thesis.tex")
    kept.write(ONE, DATA)
    assert stat.S_ISREG(path.lstat().st_mode)
    assert kept.read(ONE) == DATA
    assert (elsewhere / "thesis.tex").read_text() == "years of work"


def test_a_folder_that_is_a_link_is_used_and_loses_nothing(
    tmp_path: Path, elsewhere: Path, caplog: pytest.LogCaptureFixture
) -> None:
    link = tmp_path / "link"
    link.symlink_to(elsewhere)
    linked = Kept(link)
    linked.write(ONE, DATA)
    assert linked.read(ONE) == DATA
    linked.sweep({ONE})
    left = sorted(os.listdir(elsewhere))
    assert left == sorted([OTHER, f"{ONE}{SUFFIX}", f"{OTHER}{SUFFIX}", "thesis.tex"])
    assert link.is_symlink()
    assert [line for line in caplog.messages if "is a link" in line] == caplog.messages != []


def test_what_is_no_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "none")
    for name in ("file", "link"):
        with pytest.raises(NotADirectoryError, match=f"{name} is no folder; remove it"):
            Kept(tmp_path / name)


def test_of_two_runs_the_last_to_write_stays(kept: Kept, path: Path) -> None:
    """As by two processes at once: neither waits, and each reads what is whole."""
    other = Kept(path.parent)
    other.write(ONE, DATA)
    kept.write(ONE, DATA)
    assert kept.read(ONE) == other.read(ONE) == DATA


def test_a_write_that_another_run_sweeps_away_is_only_not_kept(
    kept: Kept, path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    plainly = Path.write_bytes

    def swept_at_once(temporary: Path, content: bytes) -> int:
        size = plainly(temporary, content)
        Kept(temporary.parent).sweep({ONE})
        return size

    monkeypatch.setattr(Path, "write_bytes", swept_at_once)
    with caplog.at_level(logging.WARNING):
        kept.write(OTHER, DATA)
    assert "is not kept" in caplog.text
    assert os.listdir(path.parent) == [path.name]


def test_a_folder_in_the_place_of_a_piece_fails_no_run(
    kept: Kept, path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path.unlink()
    (path / "thesis").mkdir(parents=True)
    assert kept.read(ONE) is None
    kept.write(ONE, DATA)
    kept.sweep(())
    assert "is not kept: [Errno" in caplog.text
    assert [str(one.relative_to(path)) for one in path.rglob("*")] == ["thesis"]
    assert os.listdir(path.parent) == [path.name]
