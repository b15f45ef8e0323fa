# Helpers of the rules: studies, digests and which files a job needs. How a job is run: execution.smk.
import os
import re
import tempfile
from functools import cache
from pathlib import Path

from spinepipe.jobs.expected import Expected
from spinepipe.problems import InputError
from spinepipe.studies import read as studies

ROOT = os.getcwd()
RESULTS = "results/{study}"
LOGS = "results/{study}/logs"
# A constant: Snakemake asks for its default, an expression, again for each of thousands of jobs.
TMPDIR = tempfile.gettempdir()


def results_of(kind):
    """Where results of studies of a kind go.

    The pattern names the studies, so that rules of other kinds may write files of the same name.
    """
    names = [re.escape(name) for name in studies.names_of_kind(Path(ROOT), kind)]
    return f"results/{{study,{'|'.join(names) or 'none of this kind'}}}"


def selection():
    """Which studies are built; those of `all` are validated, all problems told at once."""
    # A job of a cluster was validated before it was submitted.
    if not workflow.is_main_process:
        return studies.Selection.model_construct(studies=(), full=())
    problems = []
    try:
        chosen = studies.read_selection(Path(ROOT))
    except InputError as error:
        stop(error)
    for name in chosen.studies:
        try:
            check(name)
        except InputError as error:
            problems.append(f"study {name}: {error}")
    if problems:
        stop("\n".join(problems))
    return chosen


def stop(message):
    """End with a message for people: Snakemake would add where in its rules it was raised."""
    raise SystemExit(f"Nothing was run. {message}")


def everything(names):
    """All results of these studies, and job files of theirs that got lost."""
    return [
        file for name in names for file in layout(name).results() + layout(name).lost()
    ]


@cache
def check(name):
    return studies.check(Path(ROOT), name, starting=workflow.is_main_process)


def load(name):
    """The study of that name and its cohort, validated when first asked for."""
    try:
        return check(name)
    except InputError as error:
        stop(f"study {name}: {error}")


@cache
def layout(name):
    return expected(name).files


@cache
def expected(name):
    """What tells the marks that results of a study must have."""
    return Expected(ROOT, *load(name))


def tables(*names):
    """Input function: files of these tables, of those that the study at hand has."""
    return lambda wildcards: layout(wildcards.study).table_files(names)


def digest(job):
    """Params function: the mark that the files of a job for the study at hand must have."""
    return lambda wildcards: expected(wildcards.study).of_job(
        job, dict(wildcards.items())
    )


def block_digest(wildcards):
    """Params function: the mark of a block of a table."""
    place = wildcards.table, wildcards.specimen, wildcards.block
    return expected(wildcards.study).of_block(*place)


def table_digest(wildcards):
    """Params function: the mark of a table that is joined from others."""
    return expected(wildcards.study).of_table(wildcards.table)


def blocks_of_table(wildcards):
    return layout(wildcards.study).block_files(wildcards.table)


def jobs_of_block(wildcards):
    """The job files of one block of a table.

    Simulations are known only once the models are ranked: a new ranking with the same content
    then leaves them as they are.
    """
    if wildcards.table == "simulations":
        checkpoints.rank_models.get(study=wildcards.study)
    place = wildcards.table, wildcards.specimen, wildcards.block
    return layout(wildcards.study).job_files(*place)


def blocks_of_specimen(table):
    """Input function: the blocks of a table that hold the specimen at hand."""
    return lambda wildcards: layout(wildcards.study).blocks_of(
        table, wildcards.specimen
    )


def stiffness_source(wildcards):
    """Where a simulation takes its stiffness from: its own calibration or the ranking.

    Of the ranking its own set alone counts, which is part of its mark.
    """
    folder = f"results/{wildcards.study}"
    if wildcards.stiffness != "calibrated":
        ranked = checkpoints.rank_models.get(study=wildcards.study)
        return {"best": ancient(ranked.output[0])}
    file = f"specimen={wildcards.specimen}/pose={wildcards.pose}.parquet"
    return {"calibration": f"{folder}/calibrations/{file}"}


def fits_of_others(wildcards):
    """Fits of the other specimens, of which the left-out one takes the median."""
    place = wildcards.specimen, wildcards.representation, wildcards.fitted_to
    return layout(wildcards.study).fits_of_others(*place)


def base_model(wildcards):
    """The model file that a study builds on, or nothing; another study may make it."""
    base = load(wildcards.study)[0].base
    return [os.path.relpath(base.path(Path(ROOT)), ROOT)] if base else []


def shown(results, name):
    """The file of a figure, shown with its caption by `snakemake --report`."""
    path = f"{results}/figures/{name}.svg"
    return report(path, caption=f"../report/{name}.rst", category="{study}")
