"""Nothing to do, told without Snakemake: catches a run that is left out though code, settings, data
or a result changed, and one that failed and counts as finished."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from spinepipe.jobs import if_changed
from spinepipe.marks import write_marked

RESULT = "results/study/report.html"


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, bool]]:
    """Runs the command in a project with a finished result; tells status and whether it ran."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config/studies").mkdir(parents=True)
    (tmp_path / "spinepipe").mkdir()
    (tmp_path / "papers").mkdir()
    (tmp_path / "papers/one.csv").write_text("a,b\n")
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab/loads.csv").write_text("a\n")
    (tmp_path / "spinepipe/code.py").write_text("x = 1\n")
    (tmp_path / "config/studies/study.yaml").write_text(f"cohort: {tmp_path}/lab\n")
    write_marked("<p>", tmp_path / RESULT, "0" * 64)
    base = "base: {model: results/study/model.yaml}\n"
    (tmp_path / "config/studies/on_it.yaml").write_text(f"cohort: here\n{base}")

    def run(ends_with: int = 0) -> tuple[int, bool]:
        ran = tmp_path / "ran"
        ran.unlink(missing_ok=True)
        made = "open('ran', 'w'); open('results/study/model.yaml', 'w')"  # a base for another study
        command = [sys.executable, "-c", f"{made}; raise SystemExit({ends_with})"]
        monkeypatch.setattr(sys, "argv", ["if_changed", "all", *command])
        try:
            if_changed.main()
        except SystemExit as end:
            return int(str(end)), ran.exists()
        return 0, ran.exists()

    return run


def test_it_runs_once_and_then_has_nothing_to_do(run: Callable[..., tuple[int, bool]]) -> None:
    assert run() == (0, True)
    assert run() == (0, False)


def test_what_failed_is_run_again_and_its_status_is_told(
    run: Callable[..., tuple[int, bool]],
) -> None:
    assert run(3) == (3, True)
    assert run() == (0, True)


def _damage(path: Path) -> None:
    """One byte changed, with size and time of change as before."""
    status = path.stat()
    raw = bytearray(path.read_bytes())
    raw[0] ^= 1
    path.write_bytes(raw)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.parametrize(
    "change",
    [
        lambda: Path("spinepipe/code.py").write_text("x = 22\n"),
        lambda: Path("spinepipe/new.py").write_text(""),
        lambda: Path("papers/one.csv").write_text("b\n"),
        lambda: Path("config/studies/study.yaml").write_text("cohort: other\n"),
        lambda: Path("lab/loads.csv").write_text("bb\n"),
        lambda: Path("lab/more.csv").write_text("a\n"),
        lambda: Path(RESULT).unlink(),
        lambda: _damage(Path(RESULT)),
    ],
    ids=[
        "code",
        "new code",
        "published",
        "settings",
        "data",
        "new data",
        "lost result",
        "damaged result",
    ],
)
def test_a_change_is_seen(
    run: Callable[..., tuple[int, bool]], change: Callable[[], object]
) -> None:
    run()
    change()
    assert run()[1]


def test_it_is_quick_to_start() -> None:
    """It loads nothing heavy: neither pandas nor Snakemake nor mechanics."""
    asked = "import sys, spinepipe.jobs.if_changed; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True)
    assert not {"numpy", "pandas", "snakemake", "pyarrow"} & set(found.stdout.split())
