"""`spinepipe export`: a specimen's model as an OpenSim file, or the tables of a study as CSV."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from spinepipe.cli.find import known_study, specimen_of
from spinepipe.cli.program import WrongUsage
from spinepipe.cohort import Cohort
from spinepipe.files import appearing
from spinepipe.jobs.report import descriptor_of
from spinepipe.problems import InputError, one_of
from spinepipe.report.words import count
from spinepipe.schema.datapackage import FILE
from spinepipe.studies import read as studies
from spinepipe.studies.exports import Exported, problem, required_result
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.registry import every_kind, files_of, function_at, kind_of
from spinepipe.studies.study import Study
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame
from spinepipe.tidy.tables import write_tidy


def command(
    context: typer.Context,
    study: Annotated[str, typer.Argument(help="name of a study")],
    specimen: Annotated[
        str | None, typer.Argument(help="of its cohort", show_default="the first")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="file to write")
    ] = None,
    tables: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="write all tables as CSV instead")
    ] = None,
    to: Annotated[
        Literal["csv"] | None,
        typer.Option(help="write few tidy tables, CSV beside Parquet, into results/STUDY/tidy"),
    ] = None,
    pose: Annotated[
        int | None, typer.Option(metavar="N", help="a sampled joint pose; default: the nominal one")
    ] = None,
    start: Annotated[
        bool, typer.Option("--start", help="with the stiffness where fits start, not the fitted")
    ] = False,
    representation: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="of stiffness, of a cohort study; default: best on unseen motion"
        ),
    ] = None,
    matrix: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z", help="as CSV the 6 x 6 stiffness of each joint about this point, mm"
        ),
    ] = None,
    test: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="with the loads of a test, its motion beside as .mot"),
    ] = None,
) -> int:
    """Write a specimen's model as an OpenSim file, or the tables of a study as CSV."""
    root = context.obj
    if sum(one is not None for one in (output, tables, to)) != 1:
        raise WrongUsage(
            "one of -o, --to and --tables is needed",
            "a model: -o FILE; tidy tables: --to csv; all tables: --tables FOLDER",
        )
    ending = ".osim" if matrix is None else ".csv"
    if output is not None and output.suffix != ending:
        raise InputError([problem("-o", output.name, f"FILE{ending}", "rename it")])
    read, cohort = studies.check(root, known_study(study, root))
    if to is not None:
        return _write_tidy(read, cohort, root)
    if output is None:
        assert tables is not None
        return _write_tables(read, cohort, root, tables)
    kind = kind_of(read.kind)
    if kind.exports is None:
        able = one_of([name for name, other in every_kind().items() if other.exports])
        why = kind.why_no_export or "choose such a study"
        raise InputError([problem("STUDY", f"kind {read.kind}", f"a study of kind {able}", why)])
    wanted = WantedFiles(
        root=root,
        results=root / "results" / read.study,
        specimen=specimen_of(cohort, specimen),
        pose=pose,
        start=start,
        representation=representation,
        point_mm=matrix,
        test=test,
    )
    made: Exported = function_at(read.kind, kind.exports)(read, cohort, wanted)
    for path, text in (
        (output, made.document),
        (output.with_suffix(".mot"), made.motion),
    ):
        if text:
            with appearing(path) as temporary:
                temporary.write_text(text, encoding="utf-8")
    print(f"{output}: specimen {wanted.specimen}, {made.words}")
    return 0


def _write_tidy(study: Study, cohort: Cohort, root: Path) -> int:
    """Write the tidy tables, and say which."""
    page = required_result(root / files_of(study, cohort).page(), "choose another study")
    for path in write_tidy(page.parent, study.kind):
        print(path.relative_to(root))
    print(f"{FILE} beside them has the units. Next: spinepipe cite {study.study}")
    return 0


def _write_tables(study: Study, cohort: Cohort, root: Path, folder: Path) -> int:
    """Write the tables that are there, and what their columns are."""
    files = files_of(study, cohort)
    paths = [root / path for path in files.table_files(files.tables)]
    paths.append((root / files.page()).with_name(f"{CONCLUSIONS.name}.parquet"))
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
