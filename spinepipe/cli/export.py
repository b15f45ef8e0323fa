"""`spinepipe export`: a specimen's model as an OpenSim file."""

import argparse
from importlib import import_module
from pathlib import Path

from spinepipe.cli.find import specimen_of, study_names, unknown
from spinepipe.files import appearing
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.studies import read as studies
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.registry import PACKAGE, every_kind, kind_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which model, and where to."""
    parser.add_argument("study", metavar="STUDY", help="name of a study")
    parser.add_argument("specimen", metavar="SPECIMEN", help="name of a specimen of its cohort")
    parser.add_argument(
        "--pose",
        type=int,
        metavar="N",
        help="a sampled joint pose of the study's results (default: the nominal one)",
    )
    parser.add_argument(
        "--start",
        action="store_true",
        help="with the stiffness where fits start (default: the fitted one)",
    )
    parser.add_argument(
        "--representation",
        metavar="NAME",
        help="representation of stiffness, of a cohort study (default: best on held-out motion)",
    )
    parser.add_argument(
        "--matrix",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="as CSV the 6 x 6 stiffness of each joint about this point (mm, along its axes)",
    )
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="file to write"
    )


def run(options: argparse.Namespace) -> int:
    """Write the file and say which frames and which stiffness are in it."""
    ending = ".osim" if options.matrix is None else ".csv"
    if options.output.suffix != ending:
        raise InputError([_problem("-o", options.output.name, f"FILE{ending}", "rename it")])
    if options.study not in study_names(options.root):
        raise InputError([unknown("study", options.study, study_names(options.root))])
    study, cohort = studies.check(options.root, options.study)
    kind = kind_of(study.kind)
    if kind.exports is None:
        able = one_of([name for name, other in every_kind().items() if other.exports])
        why = kind.why_no_export or "choose such a study"
        raise InputError([_problem("STUDY", f"kind {study.kind}", f"a study of kind {able}", why)])
    wanted = WantedFiles(
        root=options.root,
        results=options.root / "results" / study.study,
        specimen=specimen_of(cohort, options.specimen),
        pose=options.pose,
        start=options.start,
        representation=options.representation,
        point_mm=None if options.matrix is None else tuple(options.matrix),
    )
    module, _, function = kind.exports.partition(":")
    exported = getattr(import_module(f"{PACKAGE}.{study.kind}.{module}"), function)
    document, words = exported(study, cohort, wanted)
    with appearing(options.output) as temporary:
        temporary.write_text(document, encoding="utf-8")
    print(f"{options.output}: specimen {wanted.specimen}, {words}")
    return 0


def _problem(column: str, found: str, allowed: str, remedy: str) -> InputProblem:
    return InputProblem("command line", None, column, found, allowed, remedy)
