"""`spinepipe why`: why a study is stale or failed, what its lights mean, why an effect is named."""

from pathlib import Path
from typing import Annotated

import typer

from spinepipe.cli.find import known_study
from spinepipe.cli.plan import checked, planned
from spinepipe.jobs.changed import reasons
from spinepipe.problems import InputError, one_of
from spinepipe.report.overview.index import entry
from spinepipe.report.page.study_page import SIGNS
from spinepipe.report.words import count
from spinepipe.studies import read as studies
from spinepipe.studies.exports import problem
from spinepipe.studies.registry import every_kind, function_at, kind_of


def command(
    context: typer.Context,
    study: Annotated[str, typer.Argument(help="name of a study")],
    effect: Annotated[
        str | None, typer.Argument(help="name of an effect, as in a model file")
    ] = None,
    quality: Annotated[
        bool, typer.Option("--quality", help="the lights of the report in words")
    ] = False,
) -> int:
    """Say why a study is stale or failed, what its lights mean, or why an effect is named."""
    root: Path = context.obj
    if quality:
        lines = _quality(root, known_study(study, root))
    elif effect is None:
        lines = _state(root, study)
    else:
        lines = _effect(root, study, effect)
    context.meta["data"] = {"study": study, "lines": lines}
    print("\n".join(lines))
    return 0


def _state(root: Path, name: str) -> list[str]:
    """Whether it is up to date, else why not, and how much is computed again."""
    expected = checked(root, name)
    why = reasons(expected)
    found = entry(root, name, {name: not why})
    if found.state == "failed":
        log = found.files.failure.log if found.files.failure else ""
        return [
            f"Failed: {found.trouble}",
            f"  the log: results/{log}",
            f"Next: spinepipe run {name}",
        ]
    if not why:
        return ["Up to date.", f"Next: spinepipe why {name} --quality"]
    jobs = planned(root, [expected])
    head = "Not up to date:" if found.files.newest else "No results:"
    again = f"{count(jobs.total(), 'job')} will be computed; what fits is kept."
    return [head, *(f"  {one}" for one in why), again, f"Next: spinepipe plan {name}"]


def _quality(root: Path, name: str) -> list[str]:
    """The lights of the report, the most urgent first."""
    lights = [one for one in entry(root, name, {}).told if one.place == "light"]
    if not lights:
        return [f"{name} has no report yet.", f"Next: spinepipe run {name}"]
    order = list(SIGNS)
    lights.sort(key=lambda one: order.index(one.level))
    return [f"{SIGNS[one.level]} {one.text}" for one in lights]


def _effect(root: Path, name: str, effect: str) -> list[str]:
    read, _ = studies.check(root, known_study(name, root))
    place = kind_of(read.kind).explains
    if place is None:
        able = f"a study of kind {one_of([n for n, kind in every_kind().items() if kind.explains])}"
        raise InputError([problem("STUDY", f"kind {read.kind}", able, "choose such a study")])
    lines: list[str] = function_at(read.kind, place)(root / "results" / read.study, effect)
    return lines
