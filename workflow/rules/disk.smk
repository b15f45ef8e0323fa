# What disks do to a run: files that dead processes left, clocks that are wrong, folders that vanish
# (docs/decisions/0034).
import inspect
import os
import sys
import time
from contextlib import suppress

from snakemake.dag import DAG
from snakemake.persistence import PersistenceBase
from snakemake.persistence.file import FilePersistence

from spinepipe.files import sweep


def check_record():
    """Say so where Snakemake cannot keep its record: it would end with a Python stack."""
    kept = [
        path for path in (".snakemake/locks", ".snakemake", ".") if os.path.isdir(path)
    ]
    if workflow.is_main_process and not os.access(kept[0], os.W_OK):
        stop(
            f"{Path(kept[0]).resolve()} cannot be written, where Snakemake keeps its record. Change "
            "its permissions or owner, or copy the project to a folder of your own."
        )


def load_no_inventory(self):
    """Do without what a dry run left for --trust-io-cache: it is a pickle, and to read one is to run it."""
    print(
        "warn  --trust-io-cache is ignored: it reads a pickle, and to read one is to run it",
        file=sys.stderr,
    )


@cache
def sweep_temporary_files(study):
    """Remove what processes that are no more were writing into the results of a study."""
    if workflow.is_main_process and not workflow.dryrun:
        sweep(f"results/{study}")


async def check_output_mtime(self, job, expanded_output):
    """Date input that is younger than what was just made of it back to that, and say so.

    Left alone, Snakemake ends the run. Whether a file is what it should be is told by its mark, its
    age decides nothing.
    """
    made = min(times_of(expanded_output).values(), default=None)
    for path, changed in times_of(job.input).items():
        if made is not None and changed > made:
            told = time.strftime("%Y-%m-%d %H:%M", time.localtime(changed / 1e9))
            print(
                f"warn  {path} is dated {told}, later than what was just made of it: a clock is or was "
                "wrong. It is dated back and taken as it is",
                file=sys.stderr,
            )
            with suppress(OSError):
                os.utime(path, ns=(made, made))


def times_of(paths):
    """When each of these files that are there was changed, ns."""
    times = {}
    for path in map(str, paths):
        with suppress(FileNotFoundError):
            times[path] = os.stat(path).st_mtime_ns
    return times


async def handle_log(self, job):
    """Leave an empty log, unless the folder was removed meanwhile: the missing output is told."""
    with suppress(OSError):
        await leave_log(self, job)


def read_record(self, key):
    """Snakemake's own record of a file; none where it is damaged, as the file's mark decides."""
    try:
        return read_sound_record(self, key)
    except ValueError:
        return None


def bear_with_disks():
    """Have Snakemake say in a sentence what it ends a run for, and believe nothing that is damaged."""
    asked = {
        (DAG, "check_output_mtime"): ["self", "job", "expanded_output"],
        (DAG, "handle_log"): ["self", "job"],
        (FilePersistence, "_read_record"): ["self", "key"],
        (PersistenceBase, "load_iocache"): ["self"],
    }
    for (owner, name), arguments in asked.items():
        found = list(inspect.signature(getattr(owner, name)).parameters)
        assert found == arguments, "see decisions 0034 and 0036"
    DAG.check_output_mtime = check_output_mtime
    DAG.handle_log = handle_log
    FilePersistence._read_record = read_record
    PersistenceBase.load_iocache = load_no_inventory


leave_log = DAG.handle_log
read_sound_record = FilePersistence._read_record
bear_with_disks()
check_record()
