# How jobs are run: checks before the first one, and the warm worker pool. What a run says: workflow/plugins.
import os
import sys
from pathlib import Path

from snakemake.executors.local import Executor as LocalExecutor

from spinepipe.jobs import code
from spinepipe.jobs.digest import versions
from spinepipe.jobs.pool import submit_and_wait, warm_up
from spinepipe.studies.doubts import doubts, refusals
from spinepipe.studies.registry import place_of


def check_environment():
    """Say so where a library is missing: each job would fail of it."""
    try:
        versions()
    except ImportError as error:
        stop(error)


def check_engine():
    """Refuse to run jobs as one Snakemake process each, which is many times slower.

    An executor that submits jobs sets this option itself, for jobs that do run here.
    """
    if not workflow.execution_settings.use_threads:
        stop(
            "the option force-use-threads is off: each job would start Snakemake anew, "
            "many times slower.\nLet Snakemake find profiles/default beside the Snakefile (do not pass "
            "--workflow-profile none), or add --force-use-threads."
        )


def warm_up_the_pool():
    """Have the workers' server import what the jobs at work need; a look or nothing to do starts none."""
    code.keep()
    kinds = {load(name)[0].kind for name in studies_at_work()}
    warm_up(modules_of_many(kinds))


def share_a_process():
    """Run all jobs of a submitted group in one process, on the machine it was submitted to.

    Left alone, Snakemake starts itself anew for each of them: Slurm's executor as one job step after
    the other, other executors because force-use-threads is handed on to single jobs only (and no
    profile is read there). See docs/cluster.md.
    """
    if workflow.remote_exec:
        workflow.is_local = lambda rule: True
        workflow.global_resources["_nodes"] = None  # else one at a time
        LocalExecutor.use_threads = property(lambda self: True, lambda self, told: None)


share_a_process()


def check_writable():
    """Say so at once when results cannot be written."""
    for folder in ["results", *(f"results/{name}" for name in studies_at_work())]:
        try:
            os.makedirs(folder, exist_ok=True)
            probe = Path(folder, f".probe-{os.getpid()}")
            probe.write_text("1")
            probe.unlink()
        except OSError as error:
            stop(
                f"results cannot be written to {Path(folder).resolve()}: {error.strerror}. Make "
                "room or change permissions, then run again (finished jobs are kept)."
            )


def tell_doubts():
    """Say which data look wrong; the run goes on unless they cannot be right."""
    if not workflow.is_main_process:
        return
    cohorts = {cohort.digest: cohort for _, cohort in map(load, studies_at_work())}
    for cohort in cohorts.values():
        for doubt in doubts(cohort):
            print(f"warn  {doubt}", file=sys.stderr)
    refused = [str(one) for cohort in cohorts.values() for one in refusals(cohort)]
    if refused:
        stop("\n".join(refused))


def studies_at_work():
    """Names of the studies of which this run makes files."""
    jobs = [*workflow.dag.finished_jobs, *workflow.dag.needrun_jobs()]
    return sorted(
        {job.wildcards.study for job in jobs if "study" in job.wildcards.keys()}
    )


def sweep_logs():
    """Remove the empty logs that Snakemake leaves for every job that went well.

    A folder of logs that is a link is somebody's own.
    """
    folders = (f"results/{name}/logs" for name in studies_at_work())
    for logs in (folder for folder in folders if not os.path.islink(folder)):
        for folder, _, files in os.walk(logs, topdown=False):
            for path in (os.path.join(folder, file) for file in files):
                if not os.path.getsize(path):
                    os.unlink(path)
            if not os.listdir(folder):
                os.rmdir(folder)


def run_job(rule, job, wildcards, input, output, log, **others):
    """Run a job of the study's kind in the warm pool on the files and wildcards of a rule.

    Named input and output files and the wildcards become arguments of the same name; `others`
    are further arguments, and defaults for input that only some jobs of the rule have.
    """
    kind = load(wildcards.study)[0].kind
    arguments = {**others, **arguments_of(wildcards, input, output)}
    execute(rule, place_of(kind, job), wildcards, log, arguments)


def run_core(rule, job, wildcards, input, output, log):
    """Run `spinepipe.jobs.<job>`, which serves every kind of study."""
    arguments = arguments_of(wildcards, input, output)
    execute(rule, f"spinepipe.jobs.{job}:run", wildcards, log, arguments)


def arguments_of(wildcards, input, output):
    files = {name: plain(value) for name, value in [*input.items(), *output.items()]}
    return {"root": ROOT, **wildcards, **files}


def collect(rule, wildcards, input, output, log):
    """Join the rows of many files into one table."""
    table, files = wildcards.table, plain(input)
    if "block" in wildcards.keys():
        place = table, wildcards.specimen, wildcards.block
        files = layout(wildcards.study).job_files(*place)
    marks = [expected(wildcards.study).of_part(table, path) for path in files]
    arguments = {
        "kind": load(wildcards.study)[0].kind,
        "table": table,
        "inputs": files,
        "expected": marks,
        "output": plain(output[0]),
    }
    execute(rule, "spinepipe.jobs.collect:run", wildcards, log, arguments)


def plain(value):
    """Paths as plain strings: Snakemake's own carry the whole rule with them."""
    return str(value) if isinstance(value, str) else [str(path) for path in value]


def execute(rule, function, wildcards, log, arguments):
    name = " ".join([rule, *(f"{key}={value}" for key, value in wildcards.items())])
    submit_and_wait(name, function, str(log), **arguments)
