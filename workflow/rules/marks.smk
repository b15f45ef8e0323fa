# Whether a file is what it should be is told by its own mark, not by Snakemake's record of it
# (docs/decisions/0013).
import inspect
import sys

from snakemake.persistence import ParamsChange, PersistenceBase

from spinepipe.marks import read_mark


def mark_of_rule(job):
    """The mark that the files of a job must have; None for a job without results."""
    return job.params.get("digest") if job.output else None


@cache
def mark_in(path):
    """The mark in a file, or None without the file; a file that a job rewrites is asked no more."""
    try:
        mark = read_mark(path)
    except OSError:
        return None
    if not mark:
        tell_lost(path)
    return mark or "no mark"


MOST_NAMED = 5
LOST = []


def tell_lost(path):
    """Name a file that is there and not to be believed, of many the first ones."""
    LOST.append(path)
    if len(LOST) <= MOST_NAMED:
        print(
            f"warn  {path} is damaged, cut off, empty or of an older version: it counts as lost and "
            "is computed again",
            file=sys.stderr,
        )


def tell_remade():
    """Name also damaged files that are made again anyway, as what they are made of is."""
    for job in workflow.dag.needrun_jobs():
        if mark_of_rule(job) is not None:
            for path in job.output:
                mark_in(str(path))


def tell_how_many_lost():
    """Say how many such files are not named, each time those that have come since."""
    more = len(LOST) - MOST_NAMED
    if more > 0:
        print(f"warn  so do {more} more files below results", file=sys.stderr)
        del LOST[MOST_NAMED:]


def params_changed(self, job, file=None):
    """Files of a job whose mark is not the one that they must have, or that were cut off.

    Snakemake asks for cut-off files before it knows the jobs behind a checkpoint.
    """
    wanted = mark_of_rule(job)
    if wanted is None:
        return record_of_params(self, job, file)
    sweep_temporary_files(job.wildcards.study)
    files = [file] if file is not None else job.output
    cut_off = self._filter_incomplete_keys([self._get_key(path) for path in files])
    wrong = {
        path: found
        for path in files
        if (found := mark_in(str(path))) is not None
        and (found != wanted or path in cut_off)
    }
    return ParamsChange(
        only_old=frozenset(wrong.values()),
        only_new=frozenset([wanted] if wrong else []),
        files=frozenset(map(str, wrong)),
    )


def has_metadata(self, job):
    """A job whose files carry marks is looked at even if Snakemake has no record of it."""
    return mark_of_rule(job) is not None or record_there(self, job)


def ask_the_files():
    """Have Snakemake go by the marks of files."""
    asked = {
        "params_changed": ["self", "job", "file"],
        "has_metadata": ["self", "job"],
        "_filter_incomplete_keys": ["self", "keys"],
        "_get_key": ["self", "f"],
    }
    for name, arguments in asked.items():
        found = list(inspect.signature(getattr(PersistenceBase, name)).parameters)
        assert found == arguments, "see decision 0013"
    PersistenceBase.params_changed = params_changed
    PersistenceBase.has_metadata = has_metadata


record_of_params = PersistenceBase.params_changed
record_there = PersistenceBase.has_metadata
ask_the_files()
