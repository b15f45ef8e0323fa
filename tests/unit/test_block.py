"""Job files that are made together, block by block.

Would catch files made again that are right, a block that is made of wrong ones, and one file that
fails and takes the others along.
"""

from pathlib import Path
from typing import Any

import grid_cases
import pytest

from spinepipe.jobs import block
from spinepipe.jobs.block import PartsFailed
from spinepipe.jobs.expected import Expected, place_of
from spinepipe.marks import read_mark
from spinepipe.studies.range_of_motion import draw, simulate
from spinepipe.studies.read import check
from spinepipe.tables import read_frame

STUDY, TABLE = grid_cases.STUDY, "range_of_motion"
SETTINGS = (
    "poses: 5\nstiffness_sets: 6\nvirtual_tests: {moment_nm: 7.5, tests: [flexion], steps: 2}\n"
)


@pytest.fixture
def told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Expected:
    """A study of one specimen, all drawn; a block holds two of its thirty files."""
    monkeypatch.chdir(tmp_path)
    root = grid_cases.project(tmp_path, SETTINGS, specimens=("a",))
    draw.sample_frames(str(root), STUDY, "a", "frames.parquet")
    draw.draw_stiffness(str(root), STUDY, "sets.parquet")
    return Expected(str(root), *check(root, STUDY))


def make(told: Expected, number: str, anew: bool = False) -> Path:
    output = Path(told.files.block_file(TABLE, "a", number))
    inputs = {"frames": "frames.parquet", "stiffness_sets": "sets.parquet"}
    block.run(told.root, STUDY, TABLE, "a", str(output), anew, **inputs)
    return output


def test_right_files_are_kept_wrong_ones_made_again(told: Expected) -> None:
    parts = [Path(path) for path in told.files.job_files(TABLE, "a", "000")]
    whole = make(told, "000").read_bytes()
    assert len(parts) == 2
    first = parts[0].stat().st_ino
    sound = parts[1].read_bytes()
    parts[1].write_bytes(sound[:-9])
    assert make(told, "000").read_bytes() == whole
    assert (parts[0].stat().st_ino, parts[1].read_bytes()) == (first, sound)
    assert read_mark(told.files.block_file(TABLE, "a", "000")) == told.of_block(TABLE, "a", "000")
    assert make(told, "000", anew=True).read_bytes() == whole
    assert parts[0].stat().st_ino != first


def test_blocks_hold_each_file_once(told: Expected) -> None:
    files = [f for place in told.files.blocks(TABLE) for f in told.files.job_files(TABLE, *place)]
    assert len(files) == len(set(files)) == 30
    assert len(told.files.blocks(TABLE)) == 15
    last = read_frame(make(told, "014"))
    assert set(zip(last["pose"], last["stiffness"], strict=True)) == {(4, 4), (4, 5)}


def test_a_file_that_fails_is_named_and_the_others_are_made(
    told: Expected, monkeypatch: pytest.MonkeyPatch
) -> None:
    good, bad = told.files.job_files(TABLE, "a", "001")
    run = simulate.run

    def fails(*given: Any, parts: dict[str, Any], **named: Any) -> None:
        if bad in parts:
            raise ValueError("no such spine")
        run(*given, parts=parts, **named)

    monkeypatch.setattr(simulate, "run", fails)
    with pytest.raises(PartsFailed, match=f"1 of 2 files .*\n  {bad}: ValueError: no such spine"):
        make(told, "001")
    assert read_mark(good) == told.of_job("simulate", place_of(good))
    assert not Path(told.files.block_file(TABLE, "a", "001")).exists()


def test_one_file_is_made_by_its_name(told: Expected) -> None:
    lost = Path(told.files.job_files(TABLE, "a", "003")[1])
    given = {"frames": "frames.parquet", "stiffness_sets": "sets.parquet", "block": "003"}
    block.run(told.root, STUDY, TABLE, "a", str(lost), **given)
    alone = lost.read_bytes()
    assert [path.name for path in lost.parent.iterdir()] == [lost.name]
    lost.unlink()
    make(told, "003")
    assert lost.read_bytes() == alone
