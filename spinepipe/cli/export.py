"""`spinepipe export`: a specimen's model as an OpenSim file, or the tables of a study as CSV."""

import argparse
from pathlib import Path

from spinepipe.cli.find import known_study, specimen_of
from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.jobs.report import descriptor_of
from spinepipe.problems import InputError, one_of
from spinepipe.report.words import count
from spinepipe.schema.datapackage import FILE
from spinepipe.studies import read as studies
from spinepipe.studies.exports import Exported, problem
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.registry import every_kind, files_of, function_at, kind_of
from spinepipe.studies.study import Study
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which model, and where to."""
    parser.add_argument("study", metavar="STUDY", help="name of a study")
    parser.add_argument(
        "specimen",
        nargs="?",
        metavar="SPECIMEN",
        help="name of a specimen of its cohort (default: the first)",
    )
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
        "--test",
        metavar="NAME",
        help="write the loads of a test into the file, and its motion beside it as FILE.mot",
    )
    written = parser.add_mutually_exclusive_group(required=True)
    written.add_argument("-o", "--output", type=Path, metavar="FILE", help="file to write")
    written.add_argument(
        "--tables", type=Path, metavar="FOLDER", help="write all tables of the study as CSV instead"
    )


def run(options: argparse.Namespace) -> int:
    """Write the file and say which frames and which stiffness are in it, or write the tables."""
    ending = ".osim" if options.matrix is None else ".csv"
    if options.output is not None and options.output.suffix != ending:
        raise InputError([problem("-o", options.output.name, f"FILE{ending}", "rename it")])
    study, cohort = studies.check(options.root, known_study(options.study, options.root))
    if options.tables is not None:
        return _write_tables(study, cohort, options)
    kind = kind_of(study.kind)
    if kind.exports is None:
        able = one_of([name for name, other in every_kind().items() if other.exports])
        why = kind.why_no_export or "choose such a study"
        raise InputError([problem("STUDY", f"kind {study.kind}", f"a study of kind {able}", why)])
    wanted = WantedFiles(
        root=options.root,
        results=options.root / "results" / study.study,
        specimen=specimen_of(cohort, options.specimen),
        pose=options.pose,
        start=options.start,
        representation=options.representation,
        point_mm=None if options.matrix is None else tuple(options.matrix),
        test=options.test,
    )
    made: Exported = function_at(study.kind, kind.exports)(study, cohort, wanted)
    for path, text in (
        (options.output, made.document),
        (options.output.with_suffix(".mot"), made.motion),
    ):
        if text:
            with appearing(path) as temporary:
                temporary.write_text(text, encoding="utf-8")
    print(f"{options.output}: specimen {wanted.specimen}, {made.words}")
    return 0


def _write_tables(study: Study, cohort: Cohort, options: argparse.Namespace) -> int:
    """Write the tables that are there, and what their columns are."""
    files, folder = files_of(study, cohort), options.tables
    paths = [options.root / path for path in files.table_files(files.tables)]
    paths.append((options.root / files.page()).with_name(f"{CONCLUSIONS.name}.parquet"))
    found = [path for path in paths if path.is_file()]
    if not found:
        allowed, remedy = "a computed study", f"run `snakemake -j2 {files.page()}` first"
        raise InputError([problem("STUDY", "no tables", allowed, remedy)])
    for path in found:
        with appearing(folder / f"{path.stem}.csv") as temporary:
            read_frame(path).to_csv(temporary, index=False)
    with appearing(folder / FILE) as temporary:
        told = descriptor_of(study, cohort, folder, ".csv", (CONCLUSIONS,))
        temporary.write_text(told, encoding="utf-8")
    print(f"{folder}: {count(len(found), 'table')}, explained in {FILE}")
    return 0
