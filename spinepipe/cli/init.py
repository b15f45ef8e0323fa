"""`spinepipe init [DIR]`: a project folder to work in, with the example as a first answer."""

import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import typer

from spinepipe.cli.program import FINE, WrongUsage
from spinepipe.files import CONFIG, appearing, refusal
from spinepipe.shipped import SHIPPED

DEMO = "l4l5_disc"
"""The cohort and the study of the example."""

DEMO_SECONDS = 40
"""On two quiet cores."""

_MOST_NAMED = 5

_SNAKEFILE = """\
from spinepipe.shipped import SHIPPED  # the workflow stands in the installed package
include: str(SHIPPED / "Snakefile")
"""

_CONFIG = """\
# What `spinepipe run` and `snakemake` compute when no study is named: files of config/studies.
studies: [{studies}]
"""

_FOLDERS = ("config/cohorts", "config/studies", "results")


def command(
    context: typer.Context,
    folder: Annotated[
        Path, typer.Argument(metavar="[DIR]", help="the folder; made where there is none")
    ] = Path("."),
    demo: Annotated[
        bool,
        typer.Option("--demo", help=f"add the example {DEMO} and run it (about {DEMO_SECONDS} s)"),
    ] = False,
    examples: Annotated[
        bool, typer.Option("--examples", help="add all examples (not run)")
    ] = False,
    slurm: Annotated[bool, typer.Option("--slurm", help="add a profile for Slurm")] = False,
) -> int:
    """Make a project folder: config/config.yaml, config/cohorts, config/studies, results."""
    root = folder.resolve()
    if why := refusal(root):
        what = f"{folder} cannot be a project folder: {why}"
        raise WrongUsage(what, "name another one: spinepipe init DIR")
    texts = {"Snakefile": _SNAKEFILE, str(CONFIG): _CONFIG.format(studies=DEMO if demo else "")}
    copied = dict(_copied(demo, examples, slurm))
    made, other = _write(root, {} if root == SHIPPED else {**texts, **copied})
    for name in _FOLDERS:
        (root / name).mkdir(parents=True, exist_ok=True)
    context.meta["data"] = {"folder": str(root), "made": made, "left_as_they_are": other}
    print(f"Made {folder}: {_named(made)}" if made else f"{folder}: nothing to add, all is there")
    if other:
        print(f"Left as they are, since they differ from what would be written: {_named(other)}")
    into = "" if root == Path.cwd() else f"cd {shlex.quote(str(folder))}; "
    code = _run_demo(context, root) if demo else FINE
    if code == FINE:
        print(f"Next: {into}spinepipe import YOUR_FILE.csv")
    return code


def _copied(demo: bool, examples: bool, slurm: bool) -> Iterator[tuple[str, Path]]:
    """Files that come along, by their place in the project."""
    places = ["profiles/default", *(["profiles/slurm"] if slurm else [])]
    if examples:
        places.append("config")
    elif demo:
        places += [f"config/cohorts/{DEMO}", f"config/studies/{DEMO}.yaml"]
    for place in (SHIPPED / name for name in places):
        for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if path.is_file():
                yield path.relative_to(SHIPPED).as_posix(), path


def _write(root: Path, wanted: Mapping[str, str | Path]) -> tuple[list[str], list[str]]:
    """Write texts and copies of files; which were made, and which are there with other content."""
    made, other = [], []
    for name, content in wanted.items():
        path = root / name
        held = content.read_bytes() if isinstance(content, Path) else content.encode()
        if not path.exists() and not path.is_symlink():
            with appearing(path) as temporary:
                temporary.write_bytes(held)
            made.append(name)
        elif not path.is_file() or path.read_bytes() != held:
            other.append(name)
    return made, other


def _named(names: list[str]) -> str:
    """Cohorts as folders, other files by themselves; of many their number."""
    parts = (Path(name).parts for name in names)
    told = list(dict.fromkeys("/".join(one[:3]) for one in parts))
    more = len(told) - _MOST_NAMED
    return ", ".join(told[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _run_demo(context: typer.Context, root: Path) -> int:
    """Compute the example; print what it says and where its report is."""
    # here: a folder without an example is made at once
    from spinepipe.cli.run import Watched
    from spinepipe.jobs.start import Snakemake, cores_here
    from spinepipe.report.overview.stored import stored_conclusions

    print(f"Computing {DEMO}: about {DEMO_SECONDS} s", flush=True)
    report = Path("results") / DEMO / "report.html"
    asked = context.find_root().params
    run = Snakemake(root, [str(report), "--cores", f"{cores_here()}"], DEMO)
    code = Watched(run, silent=asked["quiet"] or asked["json"], verbose=asked["verbose"]).watch()
    if code == FINE:
        answers = (told.text for told in stored_conclusions(root / report.parent))
        print(f"{next(answers, '')}\nReport: {root / report}")
        context.meta["data"]["report"] = str(root / report)
    return code
