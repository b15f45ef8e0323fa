# Snakemake's scheduler with tens of thousands of jobs that are ready (docs/decisions/0007, 0011).
import gc
from collections.abc import Sequence
from itertools import islice

from snakemake.scheduling.job_scheduler import JobScheduler

MOST_READY = 64
"""Jobs that are looked at when one has finished; of these, profiles/default has four compared."""


class Unlisted(Sequence):
    """What a function lists, listed only when somebody looks."""

    def __init__(self, listed):
        self.listed = listed

    def __getitem__(self, place):
        return self.listed()[place]

    def __len__(self):
        return len(self.listed())


class FewReady(JobScheduler):
    """A scheduler whose looks do not grow with the number of jobs.

    The first study of config.yaml goes first, so that a report is there soon, then rules with a
    priority: their jobs take long and hang on nothing, and no run is to wait for one at its end.
    """

    urgent = None

    @property
    def open_jobs(self):
        ready = self.workflow.dag.ready_jobs
        if self.urgent is None:
            self.urgent = urgent_jobs(self.workflow.dag)
        first = [job for job in self.urgent if job in ready]
        if not first:
            return list(islice(ready, MOST_READY))
        free = self.workflow.cores - len(self.running) - len(first)
        others = (job for job in ready if job not in first)
        return [*first, *islice(others, max(0, free))]

    @property
    def remaining_jobs(self):
        return Unlisted(lambda: JobScheduler.remaining_jobs.fget(self))


def urgent_jobs(dag):
    """Jobs of the first study, unless it has very many, and of rules with a priority."""
    jobs = list(dag.needrun_jobs())
    chosen = SELECTION.studies[:1]
    first = [job for job in jobs if job.wildcards.get("study") in chosen]
    with_priority = [job for job in jobs if job.rule.priority and job not in first]
    return [*(first if len(first) <= MOST_READY else []), *with_priority]


def look_at_few():
    """Let a scheduler that runs jobs here look at few of them at a time."""
    if workflow.local_exec:
        assert type(workflow.scheduler) is JobScheduler, "see decision 0011"
        workflow.scheduler.__class__ = FewReady


def lift_rate_limit():
    """Do without a limit of jobs per second, which no option turns off.

    It starts a timer whenever Snakemake looks for jobs to run, and each timer makes it look again
    (docs/decisions/0007).
    """
    if workflow.local_exec:
        assert hasattr(workflow.scheduler, "job_rate_limiter"), "see decision 0007"
        workflow.scheduler.job_rate_limiter = None


def keep_the_graph():
    """Have Python look for garbage again, but not among the jobs, which stay to the end."""
    gc.freeze()
    gc.enable()


# While the graph grows, hardly anything becomes garbage, and each look goes through all of it.
gc.disable()
