"""`spinepipe plan`: what a run will do, and how long that takes; nothing is computed."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from snakemake_logger_plugin_spinepipe.time_left import duration, job_seconds

from spinepipe.cli.find import known_study
from spinepipe.cli.program import WrongUsage
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.start import Snakemake, cores_here
from spinepipe.studies import read as studies
from spinepipe.studies.registry import kind_of


class Effort(StrEnum):
    """Of a search for effects."""

    QUICK = "quick"
    STANDARD = "standard"
    FULL = "full"


MEASURED, ESTIMATED = "measured here", "estimated"


def command(
    context: typer.Context,
    names: Annotated[list[str], typer.Argument(metavar="STUDIES...", help="names of studies")],
    cores: Annotated[
        int | None, typer.Option("-j", "--cores", min=1, help="at a time", show_default="all")
    ] = None,
    effort: Annotated[Effort | None, typer.Option(help="of a search for effects")] = None,
) -> int:
    """Say what a run will do, and how long it takes; compute nothing."""
    root: Path = context.obj
    cores = cores or cores_here()
    chosen = [checked(root, name) for name in names]
    longer = {one.study.study: with_effort(one, effort) if effort else 1.0 for one in chosen}
    changed = [one for one in chosen if longer[one.study.study] != 1.0]
    jobs = planned(root, [one for one in chosen if one not in changed])
    searches = {f"{one.study.kind}_search" for one in changed}
    jobs += planned(root, changed, "--forcerun", *sorted(searches))
    known = job_seconds(root)
    told = context.meta["data"] = []
    for one in chosen:
        name = one.study.study
        parts = list(_parts(known, name, jobs, longer[name]))
        whole = sum(part["seconds"] for part in parts) / cores
        seconds = max([whole, *(part["seconds"] / part["jobs"] for part in parts)])
        how = MEASURED if all(part["time"] == MEASURED for part in parts) else ESTIMATED
        told.append({"study": name, "up_to_date": not parts, "jobs": parts})
        told[-1] |= {"seconds": seconds, "cores": cores, "time": how}
        print(f"{name}: {kind_of(one.study.kind).question}")
        if not parts:
            print("  up to date: nothing is to be done")
            continue
        print(f"  {'part':30}{'jobs':>6}   time of all, one core")
        for part in parts:
            took = f"{duration(part['seconds']):>8}  {part['time']}"
            print(f"  {part['part']:30}{part['jobs']:>6}   {took}")
        total = sum(part["jobs"] for part in parts)
        print(f"  {'together':30}{total:>6}   about {duration(seconds)} on {cores} cores, {how}")
    late = [one["study"] for one in told if one["jobs"]]
    effort_too = f" --effort {effort.value}" if effort else ""
    print(f"Next: spinepipe run {' '.join(late)}{effort_too}" if late else "Next: spinepipe index")
    return 0


def with_effort(expected: Expected, effort: Effort) -> float:
    """How many times as long a study with another effort may take.

    Raises
    ------
    WrongUsage
        For a kind of study that has no effort.
    """
    study: Any = expected.study
    if not study.most_fits:
        raise WrongUsage(
            f"{study.study} is a study of kind {study.kind}, which has no effort",
            "leave --effort out: it is of searches for a missing effect",
        )
    return float(study.most_fits[effort.value] / study.most_fits[study.effort])


def checked(root: Path, name: str) -> Expected:
    """A study that is there and sound.

    Raises
    ------
    WrongUsage
        For a name that no study has.
    InputError
        With all that is wrong with it.
    """
    return Expected(str(root), *studies.check(root, known_study(name, root)))


def targets(chosen: Sequence[Expected]) -> list[str]:
    """The result files of studies that a run is asked for."""
    return [path for one in chosen for path in (*one.files.results(), *one.files.lost(False))]


def planned(root: Path, chosen: Sequence[Expected], *also: str) -> Counter[tuple[str, str]]:
    """Numbers of jobs that a run would do, by study and rule; more may follow a checkpoint.

    Parameters
    ----------
    also : options of Snakemake.

    Raises
    ------
    WrongUsage
        Where a run cannot be planned, with what Snakemake says.
    """
    jobs: Counter[tuple[str, str]] = Counter()
    if not chosen:
        return jobs
    said: list[str] = []
    run = Snakemake(root, [*targets(chosen), "-n", "--cores", "1", *also])
    for event in run.events():
        if event["event"] == "job":
            jobs[event["study"], event["rule"]] += 1
        elif event.get("text"):
            said.append(event["text"])
    if run.code:
        raise WrongUsage("a run cannot be planned", "\n  ".join(said[-5:]))
    return jobs


def _parts(
    known: Mapping[str, float], study: str, jobs: Counter[tuple[str, str]], longer: float
) -> Iterator[dict[str, Any]]:
    """Jobs of a study by rule, with the time that they take together; its search ``longer``."""
    for (of, rule), number in jobs.items():
        if of == study:
            own = known.get(f"{study}:{rule}")
            each = known.get(rule, 0.5) if own is None else own
            each *= longer if rule.endswith("_search") else 1.0
            time = ESTIMATED if own is None else MEASURED
            yield {"part": rule, "jobs": number, "seconds": number * each, "time": time}
