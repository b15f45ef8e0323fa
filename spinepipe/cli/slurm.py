"""Runs on Slurm: the profile with what a run adds, and whether the cluster will take it."""

import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import yaml

from spinepipe.cli.doctor import Trouble
from spinepipe.files import appearing

SLURM = Path("profiles") / "slurm" / "config.yaml"

ADDED_TO = Path(".snakemake") / "spinepipe-slurm" / "config.yaml"
"""The profile for Slurm with what a run adds to its lists."""

LISTS = (
    "--set-resources",
    "--set-threads",
    "--default-resources",
    "--groups",
    "--group-components",
)
"""Options of Snakemake that replace the whole list of a profile; ``rule:resource=value``."""

SECONDS = 60
"""That the queue has for an answer."""

FORMAT = "%P %l %a"
"""Of a line of `sinfo`: partition, the default with a star; limit of time; whether it is up."""


def check_slurm(root: Path) -> str:
    """Plugin, queue, and whether the partition lets the longest jobs of the profile end."""
    if find_spec("snakemake_executor_plugin_slurm") is None:
        remedy = "run `pip install snakemake-executor-plugin-slurm`"
        raise Trouble("Snakemake's plugin for Slurm is not installed", remedy)
    if not (root / SLURM).is_file():
        raise Trouble(f"there is no {SLURM}", "copy it from a clone of spinepipe")
    missing = [
        one
        for one in ("sinfo", "sbatch", "squeue", "scancel", "sacct")
        if shutil.which(one) is None
    ]
    if missing:
        remedy = "go to a login node, or load its module of Slurm"
        raise Trouble(f"{', '.join(missing)} cannot be found here", remedy)
    own = subprocess.run(["sacct", "-n", "-X"], capture_output=True, check=False, timeout=SECONDS)
    if own.returncode:
        remedy = "add  -- --slurm-status-command squeue  to spinepipe run"
        raise Trouble("`sacct` does not answer, so no run would hear of a job's end", remedy)
    profile = yaml.safe_load((root / SLURM).read_text("utf-8"))
    wanted = str((profile.get("default-resources") or {}).get("slurm_partition", ""))
    name, limit = _partition(wanted)
    if limit is None:
        return f"plugin and queue are there; partition {name} has no limit of time"
    late = {rule: need for rule, need in minutes_of(profile) if need > limit}
    if late:
        named = ", ".join(f"{rule} asks for {need} min" for rule, need in late.items())
        options = " ".join(f"{rule}:runtime={limit}" for rule in late)
        raise Trouble(
            f"partition {name} ends jobs after {limit} min, and {named}",
            "name a longer one with --partition, or give them less: spinepipe run STUDY --slurm "
            f"-- --set-resources {options}",
        )
    return f"plugin and queue are there; partition {name} gives {limit} min, enough for each rule"


def _partition(wanted: str) -> tuple[str, int | None]:
    """Name and limit, min, of the partition that jobs go to; None where it has no limit.

    Raises
    ------
    Trouble
        Where the queue does not answer, or has no such partition that is up.
    """
    try:
        asked = ["sinfo", "--noheader", f"--format={FORMAT}"]
        ended = subprocess.run(asked, capture_output=True, text=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        remedy = "ask who runs the cluster whether Slurm is at work"
        raise Trouble(f"`sinfo` has not answered for {SECONDS} s", remedy) from None
    if ended.returncode:
        last = (ended.stderr.strip().splitlines() or ["no output"])[-1]
        raise Trouble(f"the queue cannot be reached: {last}", "is Slurm at work? try `sinfo`")
    found = [line.split() for line in ended.stdout.splitlines()]
    names = {name.rstrip("*"): (limit, state) for name, limit, state in found}
    name = wanted or next((one[0].rstrip("*") for one in found if one[0].endswith("*")), "")
    if name not in names:
        remedy = f"write slurm_partition in {SLURM}, one of: {', '.join(names) or 'none'}"
        what = f"there is no partition {name!r}" if name else "no partition is the default"
        raise Trouble(what, remedy)
    limit, state = names[name]
    if state != "up":
        raise Trouble(f"partition {name} is {state}", "wait, or name another with --partition")
    return name, minutes(limit)


def minutes(limit: str) -> int | None:
    """A limit as `sinfo` tells it, ``days-hours:minutes:seconds``, in whole minutes.

    None where there is none.
    """
    if limit in ("infinite", "UNLIMITED", "n/a"):
        return None
    days, _, clock = limit.rpartition("-")
    parts = [int(part) for part in clock.split(":")]
    if days:  # hours come first
        parts = [*parts, 0, 0][:3]
    hours, rest = (parts[0], parts[1]) if len(parts) == 3 else (0, parts[0])
    return (int(days or 0) * 24 + hours) * 60 + rest


def minutes_of(profile: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """What the rules of a profile ask for at their first try, min; `attempt` counts as 1."""
    of_others = {"other rules": profile.get("default-resources") or {}}
    for rule, resources in {**of_others, **(profile.get("set-resources") or {})}.items():
        if found := re.match(r"\d+", str(resources.get("runtime", ""))):
            yield rule, int(found[0])


def slurm_profile(root: Path, arguments: Sequence[str], also: Sequence[str]) -> list[str]:
    """Write the profile for Slurm with what is added to its lists; arguments of Snakemake with it.

    Snakemake itself would put what is typed in the place of a whole list.

    Parameters
    ----------
    arguments : for Snakemake. also : default resources, ``slurm_account=name``.

    Raises
    ------
    FileNotFoundError
        Where the project has no profile for Slurm.
    """
    profile = yaml.safe_load((root / SLURM).read_text("utf-8"))
    rest: list[str] = []
    added: list[tuple[str, str]] = [("--default-resources", one) for one in also]
    option = ""
    for one in arguments:
        name, _, value = one.partition("=")
        if one.startswith("-"):
            option = name if name in LISTS else ""
            added += [(option, value)] if option and value else []
            rest += [] if option else [one]
        elif option:
            added.append((option, one))
        else:
            rest.append(one)
    for option, one in added:
        key, _, value = one.partition("=")
        place = profile.setdefault(option.removeprefix("--"), {})
        if isinstance(place, list):  # the other form in which a profile may have it
            place.append(one)
        elif ":" in key:
            rule, _, resource = key.partition(":")
            place.setdefault(rule, {})[resource] = yaml.safe_load(value)
        else:
            place[key] = yaml.safe_load(value)
    (root / ADDED_TO).parent.mkdir(parents=True, exist_ok=True)
    with appearing(root / ADDED_TO) as temporary:
        temporary.write_text(yaml.safe_dump(profile, sort_keys=False), "utf-8")
    return [*rest, "--profile", str(ADDED_TO.parent)]
