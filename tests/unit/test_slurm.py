"""What the doctor says of a cluster, with a `sinfo` that answers as Slurm's does.

Catches a job that would be submitted though its partition ends it before it can be done.
"""

import os
import shutil
from pathlib import Path

import pytest

from spinepipe.cli import doctor, main, slurm

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with the profile as it is shipped, and programs of Slurm that do nothing."""
    (tmp_path / "profiles/slurm").mkdir(parents=True)
    shutil.copy(ROOT / "profiles/slurm/config.yaml", tmp_path / "profiles/slurm")
    (tmp_path / "bin").mkdir()
    for name in ("sbatch", "squeue", "scancel", "sacct"):
        program(tmp_path / "bin" / name, "exit 0")
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    monkeypatch.setattr(slurm, "find_spec", lambda name: name)
    return tmp_path


def program(path: Path, does: str) -> None:
    path.write_text(f"#!/bin/sh\n{does}\n")
    path.chmod(0o755)


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ("echo 'long* 2-00:00:00 up'", ""),
        ("echo 'all* infinite up'", ""),
        ("printf 'short* 4:00:00 up\\nlong infinite up\\n'", "ends jobs after 240 min, and"),
        ("echo 'short* 4:00:00 up'", "discrepancy_search:runtime=240"),
        ("echo 'main* infinite drain'", "partition main is drain; wait"),
        ("echo 'gpu infinite up'", "no partition is the default; write slurm_partition in"),
        ("echo no route >&2; exit 1", "the queue cannot be reached: no route"),
    ],
)
def test_the_queue_is_asked_before_anything_is_submitted(
    cluster: Path, answer: str, told: str
) -> None:
    program(cluster / "bin/sinfo", answer)
    if told:
        with pytest.raises(doctor.Trouble, match=told):
            slurm.check_slurm(cluster)
    else:
        assert slurm.check_slurm(cluster).startswith("plugin and queue are there; partition")


def test_a_cluster_without_accounting_is_told(cluster: Path) -> None:
    """The plugin would ask for the state of its jobs in vain, and never end."""
    program(cluster / "bin/sinfo", "echo 'all* infinite up'")
    program(cluster / "bin/sacct", "exit 1")
    with pytest.raises(doctor.Trouble, match="--slurm-status-command squeue"):
        slurm.check_slurm(cluster)


def test_a_missing_plugin_is_told(cluster: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slurm, "find_spec", lambda name: None)
    with pytest.raises(doctor.Trouble, match="run `pip install snakemake-executor-plugin-slurm`"):
        slurm.check_slurm(cluster)


@pytest.mark.parametrize(
    ("limit", "of"),
    [("30:00", 30), ("4:00:00", 240), ("2-12:30:00", 3630), ("infinite", None), ("1-00", 1440)],
)
def test_limits_of_time(limit: str, of: int | None) -> None:
    assert slurm.minutes(limit) == of


def test_the_doctor_asks_the_cluster_when_told_to(
    cluster: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "check_engine", lambda root: "not asked")
    program(cluster / "bin/sinfo", "echo 'short* 10:00 up'")
    assert main(["--root", str(cluster), "doctor", "--slurm"]) == 1
    assert "FAIL  slurm      partition short ends jobs after 10 min" in capsys.readouterr().out
