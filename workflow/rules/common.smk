# Helpers of the rules: studies, digests and which files a job needs. How a job is run: execution.smk.
import os
import re
import tempfile
from functools import cache
from pathlib import Path

from spinepipe.jobs.expected import Expected
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.studies.registry import kind_names, kind_of, modules_of_many

ROOT = os.getcwd()
RESULTS = "results/{study}"
LOGS = "results/{study}/logs"
# A constant: Snakemake asks for its default, an expression, again for each of thousands of jobs.
TMPDIR = tempfile.gettempdir()


STUDIES = studies.names_by_kind(Path(ROOT))
KINDS_IN_USE = [name for name in kind_names() if name in STUDIES]


def one_of(names):
    """A pattern that matches these names alone."""
    return "|".join(map(re.escape, names))


def results_of(kind):
    """Where results of studies of a kind go: the pattern names the studies."""
    return f"results/{{study,{one_of(STUDIES.get(kind, ['none of this kind']))}}}"


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


def everything(names, full=False):
    """Results of these studies, with those of `full` or without, and their job files that got lost."""
    return [
        file
        for name in names
        for file in layout(name).results(full) + layout(name).lost(full)
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


def tables(*names, full):
    """Input function: files of these tables, of those that the study at hand has."""
    return lambda wildcards: layout(wildcards.study).table_files(names, full)


def inputs_of(kind, job):
    """Input of a job that reads tables; a name with a dot is a file with a name of its own."""
    folder = f"{RESULTS}/{kind.files.subfolder}"
    full = set(job.writes) <= set(kind.files.full)
    names = [name for name in job.reads if "." not in name]
    others = [name for name in job.reads if "." in name]
    return {
        "tables": tables(*names, full=full),
        **{name.split(".")[0]: f"{folder}{name}" for name in others},
    }


def outputs_of(place, kind, job):
    """Output of a job that makes tables: one is called `output`, several by their names."""
    files = {
        name: f"{place}/{kind.files.subfolder}{name}.parquet" for name in job.writes
    }
    return files if len(files) > 1 else {"output": files[job.writes[0]]}


def inputs_of_figure(wildcards):
    files = layout(wildcards.study)
    figure = files.figure(wildcards.figure)
    full = bool(set(figure.tables) & set(files.full))
    tables = files.table_files((*figure.reads, *figure.also), full)
    return {"tables": tables, **files.other_files(figure.reads)}


def inputs_of_page(wildcards):
    files = layout(wildcards.study)
    full = wildcards.page == "full"
    figures = files.figures(full)
    return {
        "tables": files.table_files(files.tables, full),
        "figures": [f"{files.folder}/figures/{figure}.svg" for figure in figures],
        "captions": [files.caption(figure) for figure in figures],
        **files.other_files(files.told_in_report),
    }


def caption_of_figure(wildcards):
    return Path(layout(wildcards.study).caption(wildcards.figure)).read_text("utf-8")


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


def figure_digest(wildcards):
    """Params function: the mark of a figure."""
    return expected(wildcards.study).of_figure(wildcards.figure)


def report_digest(wildcards):
    """Params function: the mark of a report."""
    return expected(wildcards.study).of_report(wildcards.page)


def blocks_of_table(wildcards):
    return layout(wildcards.study).block_files(wildcards.table)


def base_model(wildcards):
    """The model file that a study builds on, or nothing; another study may make it."""
    base = load(wildcards.study)[0].base
    model = base and base.model
    return [os.path.relpath(Path(ROOT) / model, ROOT)] if model else []


def jobs_of_block(wildcards):
    """The job files of one block of a table; of some tables those that are yet to be made.

    A block that is right misses no lost file: who wants it asks for it (see `everything`). One with
    files of another setting is made again, and of all its files.
    """
    for wait in WAITING.get(wildcards.table, ()):
        wait(wildcards)
    study, table = wildcards.study, wildcards.table
    place = table, wildcards.specimen, wildcards.block
    files = layout(study).job_files(*place)
    forced = workflow.dag_settings.forceall or workflow.dag_settings.forcerun
    if forced or table not in layout(study).known_by_mark:
        return files
    marks, block = expected(study), mark_in(layout(study).block_file(*place))
    wrong = {
        file: mark
        for file in files
        if (mark := mark_in(file)) != marks.of_part(table, file)
    }
    if wrong and not any(wrong.values()) and block == marks.of_block(*place):
        return []
    return list(wrong)


# What must be done before the job files of a table are known, by table: functions of wildcards.
WAITING = {}
