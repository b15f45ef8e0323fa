"""How much code the digest of a job holds: what is computed again when a line of it changes."""

from statistics import median

from spinepipe.jobs.code import code_files
from spinepipe.studies.registry import kind_names, kind_of, place_of


def sizes() -> str:
    """Median and largest number of files, and of their lines, over the jobs of all kinds."""
    held = [
        code_files(place_of(kind, job.name).partition(":")[0])
        for kind in kind_names()
        for job in kind_of(kind).jobs
    ]
    files = [len(one) for one in held]
    lines = [sum(len(path.read_text("utf-8").splitlines()) for path in one) for one in held]
    return (
        f"Digests of {len(held)} jobs: {median(files):g} files in the median ({max(files)} at "
        f"most), {median(lines):,.0f} lines ({max(lines):,})."
    )
