# What rules ask: patterns of results, input functions, digests, and how a job is run.
# Whether a file is what it should be is told by the mark that it carries (docs/decisions/0057).
import os
import re
from functools import partial
from pathlib import Path

from spinepipe.jobs import run
from spinepipe.jobs.project import Project
from spinepipe.studies.registry import kind_of

PROJECT = Project(os.getcwd())
run_job = partial(run.run_job, PROJECT)
RESULTS = "results/{study}"
LOGS = "results/{study}/logs"
OF_BLOCK = "specimen-{specimen}/block-{block}"

# Jobs that serve every kind of study.
BLOCK = run.BLOCK
JOIN = "spinepipe.jobs.block:run_joined"
DRAW = "spinepipe.jobs.draw:run"
REPORT = "spinepipe.jobs.report:run"


def one_of(names):
    """A pattern that matches these names alone."""
    return "|".join(map(re.escape, names))


def results_of(kind):
    """Where results of studies of a kind go: the pattern names the studies."""
    return f"results/{{study,{one_of(PROJECT.names.get(kind, ['none of this kind']))}}}"


def tables_in(folder, *names, of=""):
    """Output of several tables in one folder, by their names.

    Job files lie in a folder of their table, so that it opens as one; `of` says what they are of.
    """
    pattern = f"{folder}/%s/{of}.parquet" if of else f"{folder}/%s.parquet"
    return {name: update(pattern % name) for name in names}


def layout(study):
    return PROJECT.files(study)


def outdated(rule, mark=None):
    """Input function: nothing while the files of a rule carry their mark, see `Project.outdated`.

    The mark is that of the job of the rule's name, of another job, or told by a function.
    """
    mark = mark if callable(mark) else digest(mark or rule)

    def asked(wildcards):
        patterns = getattr(rules, rule).output
        files = [pattern.format(**wildcards) for pattern in patterns]
        return PROJECT.outdated(files, mark(wildcards))

    return asked


def outdated_block(rule, part, job):
    """The same for a block, and for the rule that makes a single job file of one."""
    block, single = outdated(rule, PROJECT.mark_of_block), outdated(part, job)
    return lambda wildcards: (block if "block" in wildcards.keys() else single)(wildcards)


def digest(job):
    """Params function: the mark that the files of a job for the study at hand must have."""
    return lambda wildcards: PROJECT.mark(job, wildcards)
