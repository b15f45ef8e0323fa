# Helpers of the rules: studies, digests and which files a job needs. How a job is run: execution.smk.
import os
import re
import tempfile
from functools import cache
from pathlib import Path

from spinepipe.studies import read as studies
from spinepipe.jobs.cohort_stiffness.base_model import given_digest
from spinepipe.jobs.digest import code_digest, value_digest
from spinepipe.jobs.layout import METHODS
from spinepipe.jobs.layouts import JOINED, files_of
from spinepipe.jobs.settings import relevant_settings
from spinepipe.problems import InputError

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
    study, cohort = load(name)
    return files_of(study, cohort)


def tables(*names):
    """Input function: files of these tables, of those that the study at hand has."""
    return lambda wildcards: layout(wildcards.study).table_files(names)


@cache
def digests(job, name=None):
    """What must stay the same for the result of a job to stay: code, settings, measured data."""
    code = code_digest(f"spinepipe.jobs.{job}")
    if name is None:
        return code
    study, cohort = load(name)
    settings = relevant_settings(job, study)
    given = [given_digest(ROOT, study)] if study.kind == "cohort_stiffness" else []
    return value_digest(code, settings, cohort.digest, *given)


def digest(job):
    """Params function: the digest of a job for the study at hand."""
    return lambda wildcards: digests(job, wildcards.study)


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
    """Where a simulation takes its stiffness from: its own calibration or the ranking."""
    folder = f"results/{wildcards.study}"
    if wildcards.stiffness != "calibrated":
        return {"best": f"{folder}/best.json"}
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
