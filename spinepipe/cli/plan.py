"""`spinepipe plan STUDY`: before an experiment, which effects its tests could name."""

import argparse
from pathlib import Path

from spinepipe import cohort as cohorts
from spinepipe.cli.find import known_study
from spinepipe.problems import InputError, one_of
from spinepipe.studies import read as studies
from spinepipe.studies.exports import problem
from spinepipe.studies.registry import every_kind, function_at, kind_of
from spinepipe.studies.study import STUDIES


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of which study, how often it is to be read, and where the table goes."""
    parser.add_argument(
        "study", metavar="STUDY", help="name of a study; its cohort needs no motion.csv yet"
    )
    parser.add_argument("--cycles", type=int, default=3, help="cycles of each test (default: 3)")
    parser.add_argument(
        "--misfit",
        type=float,
        nargs="+",
        default=[0.5, 0.2],
        metavar="SIZE",
        help="misfit that an effect makes, in SD of one reading (default: 0.5 0.2)",
    )
    parser.add_argument(
        "--to", type=Path, metavar="FILE", help=".csv or .parquet (default: STUDY_plan.csv)"
    )


def run(options: argparse.Namespace) -> int:
    """Print the answer in short and write the table."""
    name = known_study(options.study, options.root)
    study = studies.read(options.root / STUDIES / f"{name}.yaml", options.root)
    place = kind_of(study.kind).plans
    if place is None:
        able = f"a study of kind {one_of([n for n, kind in every_kind().items() if kind.plans])}"
        raise InputError([problem("STUDY", f"kind {study.kind}", able, "choose such a study")])
    if options.cycles < 1 or min(options.misfit) <= 0.0:
        found = f"--cycles {options.cycles} --misfit {' '.join(map(str, options.misfit))}"
        raise InputError([problem("options", found, "at least 1, and above 0", "correct them")])
    to = options.to or Path(f"{name}_plan.csv")
    cohort = cohorts.read(study.cohort_folder(options.root))
    plan = function_at(study.kind, place)
    for line in plan(study, cohort, options.root, options.cycles, options.misfit, to):
        print(line)
    return 0
