"""`spinepipe why STUDY EFFECT`: why an effect is named, or why not."""

from typing import Annotated

import typer

from spinepipe.cli.find import known_study
from spinepipe.problems import InputError, one_of
from spinepipe.studies import read as studies
from spinepipe.studies.exports import problem
from spinepipe.studies.registry import every_kind, function_at, kind_of


def command(
    context: typer.Context,
    study: Annotated[str, typer.Argument(help="name of a study that was computed")],
    effect: Annotated[str, typer.Argument(help="name of an effect, as in a model file")],
) -> int:
    """Say why an effect is named by a study, or why not."""
    root = context.obj
    read, _ = studies.check(root, known_study(study, root))
    place = kind_of(read.kind).explains
    if place is None:
        able = f"a study of kind {one_of([n for n, kind in every_kind().items() if kind.explains])}"
        raise InputError([problem("STUDY", f"kind {read.kind}", able, "choose such a study")])
    lines = function_at(read.kind, place)(root / "results" / read.study, effect)
    print("\n".join(lines))
    return 0
