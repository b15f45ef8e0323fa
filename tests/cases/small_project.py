"""Copies of the project that run small studies, so that no test touches its results.

A project that several tests look at is built once per run of the tests (`Shared`); a test that
changes something takes a copy of it. Its results say nothing of the machine (`whereabouts`). Each
start of Snakemake is counted: it takes seconds before the first job (`snakemake_starts`).
"""

import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

from whereabouts import told_of_the_machine

from spinepipe.studies.registry import place_of

_ROOT = Path(__file__).parents[2]
_PARTS = ("Snakefile", "workflow", "profiles", "spinepipe", "papers")
_STUDY = """\
study: {name}
kind: joint_pose_sensitivity
cohort: palanca_l1l4
seed: 1
loading: equilibrium
poses: {poses}
best_models: 2
block: 2
calibration:
  bound_factor: 100
  weights:
    {{anterior: 10, superior: 100, right: 1, extension: 1, right_bending: 0, left_rotation: 0}}
start_bootstrap: {{sets: 2, loadings: [equilibrium, quasi_static, dynamic]}}
damping_bootstrap: {{sets: 2, loadings: [equilibrium]}}
settle_time_s: 0.05
methods: {{poses: 1, sane_step: 0.01, accuracy: 0.1}}
landmark_precision: {{sd_mm: [1.0, 3.0], poses: 4}}
load_point: {{superior_mm: [-20, 0, 20], superior_sd_mm: 10}}
posterior: {{draws: 10, warm_up: 20, chains: 2, stiffness_factor: 10}}
"""
_NOT_PASSED_ON = ("PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
STARTS: list[str] = []
"""Arguments of each start of Snakemake in this process of the tests."""

_HANGS_S = 1200
"""A run that takes longer hangs: it does on no machine, however busy."""

_KILLED = """

import psutil
import signal
import threading
jobs_left = {count}
one_at_a_time = threading.Lock()
whole_run_job = run_job


def run_job(job, rule, *others):
    global jobs_left
    whole_run_job(job, rule, *others)
    with one_at_a_time:
        jobs_left -= rule == "{rule}"
        if not jobs_left:
            workers = psutil.Process().children(recursive=True)
            lines = [f"{{worker.pid}} {{worker.create_time()}}\\n" for worker in workers]
            Path("workers").write_text("".join(lines))
            os.kill(os.getpid(), signal.SIGKILL)
"""
"""Added to the Snakefile: Snakemake ends as by `kill -9` when so many jobs of a rule are done."""


@dataclass(frozen=True)
class Project:
    """A copy of the project with its own configuration and results."""

    folder: Path

    def write_study(self, name: str, poses: int) -> None:
        """Write a study on the cohort that comes with the project."""
        text = _STUDY.format(name=name, poses=poses)
        self.path(f"config/studies/{name}.yaml").write_text(text)

    def path(self, name: str) -> Path:
        return self.folder / name

    def job(self, kind: str, name: str) -> Path:
        """The file of a job of a kind of study."""
        module = place_of(kind, name).partition(":")[0]
        return self.path(f"{module.replace('.', '/')}.py")

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace a text in a file; it must be there."""
        text = self.path(name).read_text()
        assert old in text
        self.path(name).write_text(text.replace(old, new))

    def environment(self) -> dict[str, str]:
        """Without the path of the original package: the copy must find itself, and its plug-ins."""
        kept = {key: value for key, value in os.environ.items() if key not in _NOT_PASSED_ON}
        return {**kept, "PYTHONPATH": str(self.path("workflow/plugins"))}

    def snakemake(
        self, *arguments: str, python: str = sys.executable
    ) -> subprocess.CompletedProcess[str]:
        """Run Snakemake to its end; `stdout` holds both streams.

        A run that ends well leaves nothing of ours in the system's temporary folder.
        """
        STARTS.append(" ".join(arguments))
        with TemporaryDirectory(prefix="run-", ignore_cleanup_errors=True) as temporary:
            done = subprocess.run(
                [python, "-m", "snakemake", *arguments],
                cwd=self.folder,
                env={**self.environment(), "TMPDIR": temporary},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=_HANGS_S,
                check=False,
            )
            left = [name for name in os.listdir(temporary) if name.startswith("spinepipe")]
            assert done.returncode or not left
        return done

    def run(self, *targets: str, cores: int = 2) -> str:
        """`snakemake` for these targets, or for `all`, that has to succeed; what it said."""
        done = self.snakemake(f"-j{cores}", *(targets or ("all",)))
        assert done.returncode == 0, done.stdout
        return done.stdout

    def started(
        self, *arguments: str, stderr: int = subprocess.PIPE, **variables: str
    ) -> "subprocess.Popen[str]":
        """`spinepipe` at work on these arguments; ``variables`` of its environment are added."""
        return subprocess.Popen(
            [sys.executable, "-m", "spinepipe.cli", *arguments],
            cwd=self.folder,
            env={**self.environment(), **variables},
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
        )

    def spinepipe(self, *arguments: str) -> str:
        """What `spinepipe` said to these arguments, on both streams."""
        process = self.started(*arguments, stderr=subprocess.STDOUT)
        try:
            return process.communicate(timeout=_HANGS_S)[0]
        finally:
            process.kill()

    def rerun(self, *targets: str) -> set[str]:
        """Run again; the result files that were written."""
        before = self.files()
        self.run(*targets)
        return written(before, self.files())

    def planned(self, *targets: str) -> set[str]:
        """Result files that a run for these targets, or for `all`, would write."""
        return self.look(*(targets or ("all",)))[0]

    def look(self, *arguments: str) -> tuple[set[str], str]:
        """The same of a run with these arguments, and what Snakemake said."""
        done = self.snakemake("-n", *arguments)
        assert done.returncode == 0, done.stdout
        lines = re.findall(r"^    output: (.*)$", done.stdout, re.MULTILINE)
        files = {re.sub(r" \(.*", "", name) for line in lines for name in line.split(", ")}
        files -= {name for name in files if name.endswith(")")}  # of "(report, update)"
        assert bool(files) != ("Nothing to be done" in done.stdout)
        return {name.removeprefix("results/") for name in files}, done.stdout

    def killed_after(self, count: int, rule: str, *targets: str) -> list[tuple[int, float]]:
        """Kill Snakemake outright when so many jobs of a rule are done.

        Returns
        -------
        Process id and start of each of its workers, which have to end by themselves.
        """
        snakefile = self.path("Snakefile")
        whole = snakefile.read_text()
        snakefile.write_text(whole + _KILLED.format(rule=rule, count=count))
        ended = self.snakemake("-j2", *(targets or ("all",)))
        assert ended.returncode == -signal.SIGKILL, ended.stdout
        snakefile.write_text(whole)
        lines = self.path("workers").read_text().splitlines()
        return [(int(pid), float(start)) for pid, start in map(str.split, lines)]

    def files(self) -> dict[str, str]:
        """Result files, each with number on the disk and checksum, then date.

        Logs are left out, and the page of all studies, which is no result: each run writes it anew.
        The disk may give a new file the number of one that it replaced.
        """
        results = self.path("results")
        found = {path: path.stat() for path in results.rglob("*") if path.is_file()}
        return {
            path.relative_to(results).as_posix(): (
                f"{state.st_ino}-{crc32(path.read_bytes())} {state.st_mtime_ns}"
            )
            for path, state in found.items()
            if "logs" not in path.parts and path != results / "index.html"
        }

    def contents(self) -> dict[str, bytes]:
        return {name: self.path(f"results/{name}").read_bytes() for name in self.files()}

    def copy(self, folder: Path) -> "Project":
        """The same with its results, to be changed."""
        shutil.copytree(self.folder, folder)
        return Project(folder)


def written(before: Mapping[str, str], after: Mapping[str, str]) -> set[str]:
    """Files that were computed between two looks; those that were dated anew are none of them."""
    return {
        name
        for name, state in after.items()
        if name not in before or before[name].split()[0] != state.split()[0]
    }


def copy_project(folder: Path, solves: bool = True) -> Project:
    """The project without results and with nothing selected but a study `small`.

    solves : whether its studies will solve anything, and are to find compiled loops.
    """
    if solves:
        # Not above: it brings most of the library along, which few tests need.
        from machine_code import of_joints

        of_joints()
    folder.mkdir(parents=True)
    for part in _PARTS:
        source = _ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part)
        else:
            shutil.copy2(source, folder / part)
    cohort = Path("config/cohorts/palanca_l1l4")
    shutil.copytree(_ROOT / cohort, folder / cohort)
    (folder / "config/studies").mkdir()
    (folder / "config/config.yaml").write_text("studies: [small]\n")
    return Project(folder)


@dataclass
class Shared:
    """Projects built once per run of the tests, by whichever worker asks first; read-only.

    Attributes
    ----------
    folder : the same for all workers.
    """

    folder: Path
    _seen: dict[str, Project] = field(default_factory=dict)

    def project(self, name: str, build: Callable[[Path], Project]) -> Project:
        """The project of that name; ``build`` makes it in a folder that is yet to be made."""
        if name not in self._seen:
            with (self.folder / f"{name}.lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                self._seen[name] = self._built(name, build)
        return self._seen[name]

    def _built(self, name: str, build: Callable[[Path], Project]) -> Project:
        folder, listing = self.folder / name, self.folder / f"{name}.json"
        if not listing.exists():
            assert not folder.exists(), f"the shared project {name} could not be built, see above"
            built = build(folder)
            told = told_of_the_machine(folder)
            assert not told, told
            listing.write_text(json.dumps(built.files()))
        return Project(folder)

    def check(self) -> None:
        """No test has changed what others look at."""
        for name, project in self._seen.items():
            built = json.loads((self.folder / f"{name}.json").read_text())
            assert project.files() == built, f"a test has changed the shared project {name}"
