# The lock of a run that was killed is taken off by the next run (docs/decisions/0038).
import inspect
import sys
from contextlib import ExitStack, contextmanager

from snakemake.persistence import PersistenceBase

from spinepipe.jobs import run_lock


@contextmanager
def lock_of_the_living(self):
    """Snakemake's lock; that of runs which are no more is taken off before.

    A run that submits jobs leaves no note: they may run on when it was killed.
    """
    locks = self.path / "locks"
    with ExitStack() as to_the_end:
        with run_lock.one_at_a_time(self.path):
            for process in run_lock.take_off(locks):
                print(
                    f"warn  the run of process {process} was killed: its lock is taken off, and this run "
                    "goes on where it stood",
                    file=sys.stderr,
                )
            if workflow.local_exec:
                to_the_end.enter_context(run_lock.noted(locks))
            to_the_end.enter_context(lock_of_snakemake(self))
        yield


def lock_for_the_living():
    """Have Snakemake lock so."""
    found = list(inspect.signature(PersistenceBase.lock).parameters)
    assert found == ["self"], "see decision 0038"
    PersistenceBase.lock = lock_of_the_living
    PersistenceBase.locked = property(locked_by_the_living)


def locked_by_the_living(self):
    """Whether files of this run are locked; a run with -n asks this alone."""
    return not run_lock.abandoned(self.path / "locks") and locked_of_snakemake.fget(
        self
    )


def tell_who_is_at_work():
    """Say who holds the lock, before Snakemake advises --unlock, which would take it off the living."""
    runs = run_lock.at_work(Path(".snakemake/locks"))
    # Whether a run on another machine still lives is for the user to judge.
    alive = [run for run in runs if f" on {run_lock.HOST}," in run]
    if alive and workflow.is_main_process and "--unlock" in sys.argv:
        stop(f"A run is at work in this folder: {'; '.join(alive)}. End it first.")
    if runs and workflow.is_main_process:
        print(
            f"warn  a run is at work in this folder: {'; '.join(runs)}. What it makes is locked until it "
            "ends: wait for it, do not use --unlock",
            file=sys.stderr,
        )


lock_of_snakemake, locked_of_snakemake = PersistenceBase.lock, PersistenceBase.locked
lock_for_the_living()
tell_who_is_at_work()
