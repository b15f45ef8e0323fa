"""`python -m spinepipe.jobs.if_changed TARGET COMMAND ...`: run the command unless nothing changed.

When the command ends well, all files that results hang on (code, settings, data) are written down
with size and time of change, as they were when it began, and so are the result files. As long as
none of them changed and each result is as it was written (its own digest, `spinepipe.marks`), there
is nothing to do, which is told in seconds.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import yaml

from spinepipe.files import appearing
from spinepipe.marks import read_mark

PROJECT = (
    *("Snakefile", "requirements.lock", "config", "papers", "profiles", "spinepipe"),
    "workflow",
)
"""Files and folders of a project on which all results may hang."""

RESULTS = "results"

Stamps = dict[str, list[int]]
"""Size in bytes and time of change in ns, by path."""


def _files(place: str) -> Iterator[str]:
    """A file, or those below a folder but for hidden ones and what Python compiles."""
    if os.path.isfile(place):
        yield place
    for folder, folders, names in os.walk(place):
        folders[:] = [name for name in folders if name != "__pycache__" and name[0] != "."]
        yield from (os.path.join(folder, name) for name in names if name[0] != ".")


def stamps(places: Iterable[str]) -> Stamps:
    """Size and time of change of all files at and below these places."""
    found = {}
    for path in (path for place in places for path in _files(place)):
        status = os.stat(path)
        found[path] = [status.st_size, status.st_mtime_ns]
    return found


def inputs() -> Stamps:
    """What results may hang on: the project, and data elsewhere that study files name by a path."""
    named = []
    for path in sorted(Path("config/studies").glob("*.yaml")):
        with suppress(OSError, ValueError, yaml.YAMLError):  # told by who reads it in earnest
            study = yaml.safe_load(path.read_text(encoding="utf-8"))
            base = study.get("base") or {}
            named += [study.get("cohort"), base.get("model")]
    paths = (str(name) for name in named if name and os.sep in str(name))
    return stamps([*PROJECT, *(path for path in paths if not path.startswith(RESULTS + os.sep))])


def is_up_to_date(record: Path) -> bool:
    """Whether nothing has changed since a record was written."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        kept = json.loads(record.read_text(encoding="utf-8"))
        results: Stamps = kept["results"]
        same = kept["inputs"] == inputs() and results == stamps(results)
        return same and all(map(read_mark, results))
    return False


def main() -> None:
    """Run the command if need be; ends with its status."""
    target, *command = sys.argv[1:]
    record = Path(".snakemake") / f"spinepipe-{target}.json"
    if is_up_to_date(record):
        print(f"{target}: nothing to do. All studies: results/index.html")
        return
    begun = inputs()
    status = subprocess.run(command, check=False).returncode
    if status == 0:
        results = {path: of for path, of in stamps([RESULTS]).items() if read_mark(path)}
        with suppress(OSError), appearing(record) as temporary:
            temporary.write_text(json.dumps({"inputs": begun, "results": results}), "utf-8")
    raise SystemExit(status)


if __name__ == "__main__":
    main()
