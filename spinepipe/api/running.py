"""A study run from Python as the command line runs it: what is up to date is not made again."""

import os
from pathlib import Path

from spinepipe.api.results import Results
from spinepipe.api.study import Say
from spinepipe.jobs.start import Snakemake
from spinepipe.progress import silent
from spinepipe.studies import read as studies
from spinepipe.studies.registry import files_of
from spinepipe.studies.study import STUDIES

TOLD_LINES = 20
"""Of what Snakemake said of a run that failed."""


def run(
    study: str | Path, *, cores: int | None = None, force: bool = False, say: Say = silent
) -> Results:
    """Make the report of a study, and all that it needs, by Snakemake; jobs resume.

    Parameters
    ----------
    study : name of a study of the project in or above the working folder, or its file
        ``config/studies/<study>.yaml`` in any project.
    cores : jobs at a time; all cores by default.
    force : make everything again, up to date or not.
    say : told how far the run is, such as `print`.

    Raises
    ------
    InputError
        With all that is wrong with the study and its cohort.
    RuntimeError
        Where a job fails, with the last lines that were said.
    """
    path = Path(study).absolute()
    if path.suffix == studies.ENDING:
        root = path.parents[len(STUDIES.parts)]
    else:
        here = Path.cwd()
        places = (one for one in (here, *here.parents) if (one / "config").is_dir())
        root, path = next(places, here), Path(study)
    checked = studies.check(root, path.stem)
    asked = [files_of(*checked).page(), "--cores", f"{cores or os.cpu_count()}"]
    process, lines = Snakemake(root, [*asked, *["--forceall"] * force], path.stem), list[str]()
    for event in process.events():
        if event["event"] == "progress":
            say(f"{event['done']} of {event['total']} jobs: {event['last']}")
        elif "text" in event:
            lines.append(event["text"])
            say(event["text"])
    if process.code:
        raise RuntimeError("\n".join([f"{path.stem}: a job failed", *lines[-TOLD_LINES:]]))
    return Results(root / "results" / path.stem)
