"""`spinepipe why STUDY EFFECT`: why an effect is named, or why not."""

import argparse
from importlib import import_module

from spinepipe.cli.find import study_names, unknown
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.studies import read as studies
from spinepipe.studies.registry import PACKAGE, every_kind, kind_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of which study, and which effect."""
    parser.add_argument("study", metavar="STUDY", help="name of a study that was computed")
    parser.add_argument("effect", metavar="EFFECT", help="name of an effect, as in a model file")


def run(options: argparse.Namespace) -> int:
    """Print what its results say of the effect."""
    if options.study not in study_names(options.root):
        raise InputError([unknown("study", options.study, study_names(options.root))])
    study, _ = studies.check(options.root, options.study)
    kind = kind_of(study.kind)
    if kind.explains is None:
        able = one_of([name for name, other in every_kind().items() if other.explains])
        place = ("command line", None, "STUDY", f"kind {study.kind}")
        raise InputError([InputProblem(*place, f"a study of kind {able}", "choose such a study")])
    module, _, function = kind.explains.partition(":")
    why = getattr(import_module(f"{PACKAGE}.{study.kind}.{module}"), function)
    print("\n".join(why(options.root / "results" / study.study, options.effect)))
    return 0
