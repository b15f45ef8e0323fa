"""What a disk did to results is named in a sentence and computed again; no table is made of it.

What would be caught: a file that is flipped, cut off, prolonged, dated wrongly, edited or replaced
by a pickle and is believed; a lost job file that takes more with it than is made of it, or comes
back with other bytes; files of dead processes that stay.
"""

import os
import time
from pathlib import Path

import planted
import pytest
from small_project import Project, written

pytestmark = pytest.mark.slow

POSES = "joint_pose_sensitivity"


def simulation(pose: int, stiffness: str) -> str:
    return f"{POSES}/jobs/specimen-s01/pose-{pose:04d}/stiffness-{stiffness}.parquet"


FLIPPED, CUT = simulation(0, "best01"), simulation(2, "best01")
LATE = f"{POSES}/calibrations.parquet"
PICKLED = simulation(0, "best02")
RANKED = f"{POSES}/best.json"
BLOCK = f"{POSES}/blocks/simulations/specimen-s01/block-001.parquet"

FITS = "cohort_stiffness/fits"
OF_B = "specimen-b/representation-per_joint/fitted_to-flexion.parquet"
FIT = f"{FITS}/stiffness/{OF_B}"
MOVED = "range_of_motion/jobs/specimen-b/pose-0001/stiffness-00.parquet"
MOTION = "tracking/opensim/a/flexion_extension/optk_generic.mot"
LOST = (FIT, MOVED, MOTION)
OF_FIT = {f"{FITS}/{name}/{OF_B}" for name in ("stiffness", "fits", "errors", "nuisances")}
"""Made by the job of a lost file."""

ASKED = (
    *(f"results/{POSES}/{name}.parquet" for name in ("simulations", "agreement")),
    *(f"results/{name}" for name in (RANKED, FLIPPED, PICKLED)),
    f"results/{FIT}",
    f"results/{MOTION}",
    "all",
)
"""`all` of one kind, as it alone misses job files whose tables are there; of others no pages, which
are drawn for longer than all else takes."""


def spoil(project: Project, name: str, content: bytes) -> None:
    """Other bytes in a file of the same age."""
    path = project.path(f"results/{name}")
    age = path.stat().st_mtime_ns
    path.write_bytes(content)
    os.utime(path, ns=(age, age))


def test_damaged_and_lost_files_are_computed_again_by_the_same_run_with_the_same_bytes(
    eight: Project, tmp_path: Path
) -> None:
    done = eight.copy(tmp_path / "project")
    content = done.contents()
    flipped = bytearray(content[FLIPPED])
    flipped[len(flipped) // 3] ^= 0x10
    spoil(done, FLIPPED, bytes(flipped))
    spoil(done, CUT, content[CUT][:-100])
    to_come = time.time() + 86400
    os.utime(done.path(f"results/{LATE}"), (to_come, to_come))
    sprung = tmp_path / "sprung"
    spoil(done, PICKLED, planted.a_pickle(sprung))
    done.edit("config/config.yaml", "studies: [", "studies: [range_of_motion] # ")
    for name in LOST:
        done.path(f"results/{name}").unlink()
    folder = done.path(f"results/{FLIPPED}").parent
    dead, living = (f".stiffness=best01.parquet.{pid}" for pid in (2**30, os.getpid()))
    for name in (dead, living):
        (folder / name).write_bytes(b"PAR1")
    strays = planted.plant(done.folder, sprung)

    before = done.files()
    checked = done.spinepipe("check", "--results", POSES)
    for name in (FLIPPED, PICKLED):
        assert checked.count(f"results/{name}: damaged") == 1
    spoil(done, RANKED, content[RANKED].replace(b'"pose": ', b'"pose": 1'))
    spoil(done, BLOCK, content[BLOCK] + b"more")
    former = done.path(f"results/{POSES}/jobs/specimen=s01/pose=0000/stiffness=best01.parquet")
    former.parent.mkdir(parents=True)
    former.write_bytes(content[FLIPPED])  # as versions before decision 0063 called it: twice a row
    said = done.run(*ASKED)
    for name in (RANKED, BLOCK):
        assert said.count(f"results/{name} is damaged") == 1
    assert f"{LATE} was dated in the future" in said
    assert "Traceback" not in said
    assert not (folder / dead).exists()
    assert not sprung.exists()  # nothing that was planted has run
    for path in (folder / living, *strays):
        path.unlink(missing_ok=True)
    assert done.contents() == content
    again = written(before, done.files())
    jobs = {name for name in again if "-" in name and "/blocks/" not in name}
    assert jobs == {FLIPPED, CUT, PICKLED, MOVED} | OF_FIT
    assert MOTION in again
