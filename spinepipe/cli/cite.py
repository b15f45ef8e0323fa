"""`spinepipe cite STUDY`: methods to copy, references, versions."""

from typing import Annotated

import typer

from spinepipe.citing.cite import bibtex, csl_json, methods, references, versions
from spinepipe.cli.find import known_study
from spinepipe.report.conclusions import read_back
from spinepipe.studies import read as studies
from spinepipe.studies.exports import required_result
from spinepipe.studies.registry import files_of
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame, read_metadata


def command(
    context: typer.Context,
    study: Annotated[str, typer.Argument(help="name of a study that was computed")],
    paragraph: Annotated[bool, typer.Option("--methods", help="the paragraph alone")] = False,
    bib: Annotated[bool, typer.Option("--bibtex", help="references as BibTeX alone")] = False,
    csl: Annotated[bool, typer.Option("--csl", help="references as CSL-JSON alone")] = False,
    run: Annotated[bool, typer.Option("--versions", help="versions and digests alone")] = False,
) -> int:
    """Print a paragraph of methods, references and versions of a study, to be copied."""
    root = context.obj
    read, cohort = studies.check(root, known_study(study, root), starting=False)
    files = files_of(read, cohort)
    page = root / files.page()
    required_result(page, "choose another study")
    table = next(path for one in files.table_files(files.tables) if (path := root / one).is_file())
    made = read_metadata(table)
    conclusions = read_back(read_frame(page.with_name(f"{CONCLUSIONS.name}.parquet")))
    text = methods(conclusions, made["version_spinepipe"])
    entries = references(text)
    everything = not (paragraph or bib or csl or run)
    if paragraph or everything:
        print(f"{text}\n\nSettings: config/studies/{study}.yaml, seed {made['seed']}.")
        print(f"Data: {' '.join(cohort.source.split())}")
    if bib or everything:
        print(bibtex(entries))
    if csl:
        print(csl_json(entries))
    if run or everything:
        print("".join(f"{k}: {v}\n" for k, v in versions(made).items()), end="")
    if everything:
        print(f"Next: spinepipe cite {study} --csl for Zotero, or spinepipe archive {study}.")
    return 0
