"""`spinepipe doctor`: can this computer run the studies? Typer and the standard library suffice."""

import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path
from typing import Annotated

import typer

from spinepipe.files import cache_home, cache_of_project, refusal
from spinepipe.jobs.start import cores_here
from spinepipe.reference.licences import pinned
from spinepipe.shipped import IN_A_CLONE, SHIPPED

LOCK = "requirements.lock"
PROFILE = Path("profiles") / "default" / "config.yaml"
TUNED = {
    "force-use-threads": "true",
    "scheduler": "greedy",
    "max-jobs-per-timespan": "100000/1h",
    "nolock": "true",
}
"""Options without which a run takes many times longer, waits at its end, or leaves a lock."""

LARGEST_ERROR = 1e-9
"""Relative; Newton ends below 1e-9 rad of the closed form."""

SECONDS_FOR_ENGINE = 120


class Trouble(Exception):
    """A finding that keeps studies from running, and the remedy."""

    def __init__(self, found: str, remedy: str) -> None:
        super().__init__(f"{found}; {remedy}")


def command(
    context: typer.Context,
    slurm: Annotated[
        bool, typer.Option("--slurm", help="the cluster too: plugin, queue, limits of time")
    ] = False,
) -> int:
    """Test this installation."""
    checks: dict[str, Callable[[Path], str]] = {
        "python": check_python,
        "libraries": check_libraries,
        "engine": check_engine,
        "profile": check_profile,
        "results": check_results,
        "cache": check_cache,
        "cores": check_cores,
    }
    if slurm:
        from spinepipe.cli.slurm import check_slurm

        checks["slurm"] = check_slurm
    found = context.meta["data"] = []
    for name, check in checks.items():
        try:
            found.append({"check": name, "ok": True, "found": check(context.obj)})
        except (Trouble, OSError) as trouble:
            found.append({"check": name, "ok": False, "found": str(trouble)})
        print(
            f"{'ok  ' if found[-1]['ok'] else 'FAIL'}  {name:10} {found[-1]['found']}", flush=True
        )
    return 0 if all(one["ok"] for one in found) else 1


def check_python(root: Path) -> str:
    """Whether this Python is one the package was made for."""
    try:
        wanted = metadata("spinepipe")["Requires-Python"] or ""
    except PackageNotFoundError:
        raise Trouble("the package spinepipe is not installed", "run `make env`") from None
    for sign, number in re.findall(r"(>=|<)\s*([0-9.]+)", wanted):
        limit = tuple(int(part) for part in number.split("."))
        here = sys.version_info[: len(limit)]
        if (here < limit) if sign == ">=" else (here >= limit):
            remedy = f"make the environment with a Python {wanted}"
            raise Trouble(f"Python {platform.python_version()}, needed {wanted}", remedy)
    return f"{platform.python_version()} ({wanted})"


def check_libraries(root: Path) -> str:
    """Whether each library has the version that the lock file pins."""
    lock = (root if IN_A_CLONE else SHIPPED) / LOCK
    if not lock.is_file():
        raise Trouble(f"no {LOCK} in {root}", "go to the folder of the Snakefile or pass --root")
    pins = pinned(lock)
    wrong = [told for name, wanted in pins.items() if (told := _deviation(name, wanted))]
    if wrong and not IN_A_CLONE and not any("missing" in one for one in wrong):
        # pip chose versions within the ranges of the package
        return f"{len(pins) - len(wrong)} as tested, other versions of {', '.join(wrong)}"
    if wrong:
        remedy = f"run `pip install --require-hashes -r {LOCK if IN_A_CLONE else lock}`"
        raise Trouble(", ".join(wrong), remedy)
    return f"{len(pins)} have the versions of {LOCK}"


def _deviation(name: str, wanted: str) -> str:
    try:
        found = version(name)
    except PackageNotFoundError:
        return f"{name} is missing"
    return "" if found == wanted else f"{name} is {found}, not {wanted}"


def check_engine(root: Path) -> str:
    """Whether the engine loads a model and finds M / k; in a process of its own, it may crash."""
    command = [sys.executable, "-m", "spinepipe.cli.engine"]
    remedy = f"reinstall pybullet, numpy and scipy from {LOCK} on this computer"
    ended = subprocess.run(
        command, capture_output=True, text=True, timeout=SECONDS_FOR_ENGINE, check=False
    )
    if ended.returncode < 0:
        raise Trouble(f"the engine crashed ({signal.Signals(-ended.returncode).name})", remedy)
    lines = ended.stdout.split()
    if ended.returncode or not lines:
        last = (ended.stderr.strip().splitlines() or ["no output"])[-1]
        raise Trouble(f"the engine failed: {last}", remedy)
    error = float(lines[-1])
    if not error < LARGEST_ERROR:
        raise Trouble(f"an equilibrium is {error:.1e} from the closed form M/k", remedy)
    return f"pybullet loads a model; equilibrium within {error:.0e} of the closed form M/k"


def check_profile(root: Path) -> str:
    """Whether Snakemake will find the options that make thousands of short jobs fast."""
    path = root / PROFILE
    if not path.is_file():
        remedy = "restore it from the repository, or go to the folder of the Snakefile"
        raise Trouble(f"no {PROFILE.as_posix()} in {root}", remedy)
    options = _options(path.read_text(encoding="utf-8"))
    missing = [f"{key}: {value}" for key, value in TUNED.items() if options.get(key) != value]
    if missing:
        raise Trouble(f"{PROFILE.as_posix()} lacks {', '.join(missing)}", "add it")
    return f"{PROFILE.as_posix()} has the tuned options"


def _options(text: str) -> dict[str, str]:
    """Top-level `key: value` lines of a profile."""
    pairs = re.findall(r"^([a-z-]+):\s*([^#\n]*)", text, re.MULTILINE)
    return {key: value.strip().strip("\"'").lower() for key, value in pairs}


def check_results(root: Path) -> str:
    """Whether results can be written, and the room there is."""
    folder = root / "results"
    place = folder if folder.exists() else root
    if why := refusal(place):
        remedy = "make room, change its permissions, or work in another folder"
        raise Trouble(f"{place} cannot be written: {why}", remedy)
    free = shutil.disk_usage(place).free / 1e9
    return f"{folder} can be written, {free:.1f} GB free"


def check_cache(root: Path) -> str:
    """Whether Snakemake can keep its cache: where not, it ends with a Python stack."""
    place = cache_home()
    if why := refusal(place / "snakemake"):
        own = shlex.quote(str(cache_of_project(root)))
        remedy = f"before `snakemake`, run `export XDG_CACHE_HOME={own}` (`make` does so itself)"
        raise Trouble(f"{place} cannot be written, where Snakemake keeps its cache: {why}", remedy)
    return f"{place} can be written"


def check_cores(root: Path) -> str:
    """How many cores a run takes."""
    return f"{cores_here()}; `spinepipe run` takes all of them, -j N takes N"
