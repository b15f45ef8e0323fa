# Every helper of the rules: studies, paths, digests, and how a job is run.
import json
import os
from collections import Counter
from functools import cache
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger

from spinepipe import studies
from spinepipe.jobs.digest import code_digest, value_digest
from spinepipe.jobs.pool import submit_and_wait
from spinepipe.jobs.progress import Progress
from spinepipe.problems import InputError

ROOT = os.getcwd()
RESULTS = "results/{study}"
LOGS = "results/{study}/logs"
TABLES = ("landmarks", "poses", "calibrations", "simulations")
FIGURES = ("stiffness", "errors", "joint_pose")
BLOCK = 200  # files per table block: a flat fan-in of thousands costs quadratic time
# Parts of a study that a job does not look at: changing them keeps its results. Everything
# else counts, so that a setting added later is never overlooked.
UNUSED = {
    "sample_landmarks": {"title", "best_models"},
    "build_models": {"title", "best_models"},
    "calibrate": {"title", "best_models"},
    "rank": {"title"},
    "simulate": {"title", "best_models"},
    "figures": set(),
    "collect": set(),
}


def check_engine():
    """Refuse to run jobs as one Snakemake process each, which is 70 times slower."""
    if not workflow.execution_settings.use_threads:
        raise WorkflowError(
            "the option force-use-threads is off, each job would start Snakemake anew (70 times "
            "slower).\nLet Snakemake find profiles/default beside the Snakefile (do not pass "
            "--workflow-profile none), or add --force-use-threads."
        )


def selected_studies():
    """Names of the studies that `all` builds, each validated; all problems are told at once."""
    names = config.get("studies") or []
    problems = []
    for name in names:
        try:
            load(name)
        except WorkflowError as error:
            problems.append(str(error))
    if problems:
        raise WorkflowError("\n".join(problems))
    return names


@cache
def load(name):
    """The study of that name and its cohort."""
    try:
        return studies.check(Path(ROOT), name)
    except InputError as error:
        raise WorkflowError(f"study {name}: {error}") from None


def drop_job_chatter():
    """Keep Snakemake from writing two lines per job; its warnings and errors stay."""
    chatter = ("Select jobs to execute", "Execute ")
    logger.addFilter(lambda record: not str(record.msg).startswith(chatter))


@cache
def digests(job, name=None):
    """What must stay the same for the result of a job to stay: code, settings, measured data."""
    code = code_digest(f"spinepipe.jobs.{job}")
    if name is None:
        return code
    study, cohort = load(name)
    settings = study.model_dump(mode="json", exclude=UNUSED[job])
    return value_digest(code, settings, cohort.digest)


def stiffnesses(name):
    study, _ = load(name)
    return ["calibrated"] + [f"best{rank:02d}" for rank in range(1, study.best_models + 1)]


@cache
def blocks(name, files_per_pose):
    """Poses of each block of a table: `000` -> (`0000`, `0001`, …)."""
    study, _ = load(name)
    size = max(1, BLOCK // files_per_pose)
    poses = [f"{pose:04d}" for pose in range(study.poses)]
    starts = range(0, study.poses, size)
    return {f"{block:03d}": poses[at : at + size] for block, at in enumerate(starts)}


def files_per_pose(table, name):
    return 1 if table == "calibrations" else len(stiffnesses(name))


def block_files(table):
    """Input function: the blocks of a whole table."""

    def files(wildcards):
        name = wildcards.study
        return [
            f"results/{name}/blocks/{table}/specimen={specimen}/block={block}.parquet"
            for specimen in load(name)[1].specimen_names
            for block in blocks(name, files_per_pose(table, name))
        ]

    return files


def block_poses(table, wildcards):
    """The poses of one block."""
    name = wildcards.study
    return blocks(name, files_per_pose(table, name)).get(wildcards.block, [])


def calibrations_of_block(wildcards):
    folder = f"results/{wildcards.study}/calibrations/specimen={wildcards.specimen}"
    return [f"{folder}/pose={pose}.parquet" for pose in block_poses("calibrations", wildcards)]


def simulations_of_block(wildcards):
    """The simulations of one block, known once the models are ranked: a new ranking with the
    same content then leaves them as they are."""
    checkpoints.rank_models.get(study=wildcards.study)
    folder = f"results/{wildcards.study}/jobs/specimen={wildcards.specimen}"
    return [
        f"{folder}/pose={pose}/stiffness={stiffness}.parquet"
        for pose in block_poses("simulations", wildcards)
        for stiffness in stiffnesses(wildcards.study)
    ]


def stiffness_source(wildcards):
    """Where a simulation takes its stiffness from: its own calibration or the ranking."""
    if wildcards.stiffness == "calibrated":
        folder = f"results/{wildcards.study}/calibrations/specimen={wildcards.specimen}"
        return {"calibration": f"{folder}/pose={wildcards.pose}.parquet"}
    return {"best": f"results/{wildcards.study}/best.json"}


def study_results(name):
    tables = [f"results/{name}/{table}.parquet" for table in TABLES]
    return tables + [f"results/{name}/figures/{figure}.svg" for figure in FIGURES]


def totals():
    """Jobs per rule in this run, as far as Snakemake knows them by now."""
    dag = workflow.dag
    return Counter(job.rule.name for job in [*dag.finished_jobs, *dag.needrun_jobs()])


progress = Progress(totals)


def run_job(job, wildcards, input, output, log, **others):
    """Run `spinepipe.jobs.<job>` on the files and wildcards of a rule.

    Named input and output files and the wildcards become arguments of the same name; `others`
    are further arguments, and defaults for input that some jobs of a rule do not have.
    """
    files = {name: plain(value) for name, value in [*input.items(), *output.items()]}
    execute(job, job, wildcards, log, root=ROOT, **{**others, **wildcards, **files})


def collect(table, wildcards, input, output, log):
    """Join the rows of many files into one table."""
    inputs = [str(path) for path in input]
    execute("collect", table, wildcards, log, table=table, inputs=inputs, output=str(output[0]))


def plain(value):
    """Paths as plain strings: Snakemake's own carry the whole rule with them."""
    return str(value) if isinstance(value, str) else [str(path) for path in value]


def execute(job, label, wildcards, log, **arguments):
    """Run one job in the warm pool and count it."""
    progress.start(label)
    name = " ".join([label, *(f"{key}={value}" for key, value in wildcards.items())])
    submit_and_wait(name, f"spinepipe.jobs.{job}:run", str(log), **arguments)
    progress.finish(label)


def check_writable(names):
    """Say so at once when results cannot be written."""
    for folder in ["results", *(f"results/{name}" for name in names)]:
        try:
            os.makedirs(folder, exist_ok=True)
            probe = Path(folder, f".probe-{os.getpid()}")
            probe.write_text("1")
            probe.unlink()
        except OSError as error:
            where = Path(folder).resolve()
            raise WorkflowError(
                f"results cannot be written to {where}: {error.strerror}. Make room or change "
                "its permissions, then run the same command again (finished jobs are kept)."
            ) from None


def say_where(names):
    for name in names:
        print(f"{name}: tables and figures in {Path('results', name).resolve()}", file=sys.stderr)


def figure(name):
    """One figure of a study, shown with its caption by `snakemake --report`."""
    return report(
        f"{RESULTS}/figures/{name}.svg", caption=f"../report/{name}.rst", category="{study}"
    )
