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

    Rules with a priority have jobs of minutes that hang on nothing: the first look starts with
    them, so that no run waits for one of them alone at its end.
    """

    first_look = True

    @property
    def open_jobs(self):
        ready = self.workflow.dag.ready_jobs
        if self.first_look:
            self.first_look = False
            if longest := [job for job in ready if job.rule.priority]:
                return longest
        return list(islice(ready, MOST_READY))

    @property
    def remaining_jobs(self):
        return Unlisted(lambda: JobScheduler.remaining_jobs.fget(self))


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
