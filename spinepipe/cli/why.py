"""`spinepipe why STUDY EFFECT`: why an effect is named, or why not."""

import argparse

from spinepipe.cli.find import known_study
from spinepipe.problems import InputError, one_of
from spinepipe.studies import read as studies
from spinepipe.studies.exports import problem
from spinepipe.studies.registry import every_kind, function_at, kind_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of which study, and which effect."""
    parser.add_argument("study", metavar="STUDY", help="name of a study that was computed")
    parser.add_argument("effect", metavar="EFFECT", help="name of an effect, as in a model file")


def run(options: argparse.Namespace) -> int:
    """Print what its results say of the effect."""
    study, _ = studies.check(options.root, known_study(options.study, options.root))
    place = kind_of(study.kind).explains
    if place is None:
        able = f"a study of kind {one_of([n for n, kind in every_kind().items() if kind.explains])}"
        raise InputError([problem("STUDY", f"kind {study.kind}", able, "choose such a study")])
    lines = function_at(study.kind, place)(options.root / "results" / study.study, options.effect)
    print("\n".join(lines))
    return 0
