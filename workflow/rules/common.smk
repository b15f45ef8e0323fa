# Helpers of the rules: studies, digests and which files a job needs. How a job is run: execution.smk.
import os
from functools import cache
from pathlib import Path

from snakemake.exceptions import WorkflowError

from spinepipe import studies
from spinepipe.jobs.digest import code_digest, value_digest
from spinepipe.jobs.layout import Layout
from spinepipe.problems import InputError

ROOT = os.getcwd()
RESULTS = "results/{study}"
LOGS = "results/{study}/logs"
# Parts of a study that a job does not look at: changing them keeps its results. Everything
# else counts, so that a setting added later is never overlooked.
UNUSED = {
    "sample_landmarks": {"title", "best_models"},
    "build_models": {"title", "best_models"},
    "calibrate": {"title", "best_models"},
    "rank": {"title"},
    "simulate": {"title", "best_models"},
    "figures": set(),
}


def selected_studies():
    """Names of the studies that `all` builds, each validated; all problems are told at once."""
    problems = []
    for name in config.get("studies") or []:
        try:
            load(name)
        except WorkflowError as error:
            problems.append(str(error))
    if problems:
        raise WorkflowError("\n".join(problems))
    return config.get("studies") or []


@cache
def load(name):
    """The study of that name and its cohort, validated when first asked for."""
    try:
        return studies.check(Path(ROOT), name)
    except InputError as error:
        raise WorkflowError(f"study {name}: {error}") from None


@cache
def layout(name):
    study, cohort = load(name)
    return Layout(name, tuple(cohort.specimen_names), study.poses, study.best_models)


@cache
def digests(job, name=None):
    """What must stay the same for the result of a job to stay: code, settings, measured data."""
    code = code_digest(f"spinepipe.jobs.{job}")
    if name is None:
        return code
    study, cohort = load(name)
    settings = study.model_dump(mode="json", exclude=UNUSED[job])
    return value_digest(code, settings, cohort.digest)


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


def stiffness_source(wildcards):
    """Where a simulation takes its stiffness from: its own calibration or the ranking."""
    folder = f"results/{wildcards.study}"
    if wildcards.stiffness != "calibrated":
        return {"best": f"{folder}/best.json"}
    file = f"specimen={wildcards.specimen}/pose={wildcards.pose}.parquet"
    return {"calibration": f"{folder}/calibrations/{file}"}


def figure(name):
    """One figure of a study, shown with its caption by `snakemake --report`."""
    path = f"{RESULTS}/figures/{name}.svg"
    return report(path, caption=f"../report/{name}.rst", category="{study}")
