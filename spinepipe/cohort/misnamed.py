"""Files of a cohort folder that were meant to be tables and have another name.

A misspelt table would count as absent, which is allowed for most. Notes and raw data may lie beside
the tables, so only names that are very like an absent one are told.
"""

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from itertools import islice
from pathlib import Path

from spinepipe.documents.strays import is_hidden
from spinepipe.problems import InputProblem

LIKE = 0.8
"""Least likeness of two names without their endings: joint and joints have 0.91."""

MOST_FILES = 10_000
"""Files of a folder that are looked at."""

LONGEST = 40
"""Characters of a name that is looked at."""

ENDINGS = {
    ".csv": (".csv", ".csv.txt", ".txt", ".tsv"),
    ".yaml": (".yaml", ".yml", ".yaml.txt", ".yml.txt"),
}
"""Endings that programs give the files."""


def misnamed(folder: Path, name: str, absent: Sequence[str]) -> Iterator[InputProblem]:
    """Files that are most likely the absent ones.

    Parameters
    ----------
    folder, name : of the cohort, and how messages call it.
    absent : names of files that are looked for and not there.
    """
    for path in sorted(islice(folder.iterdir(), MOST_FILES)):
        if len(path.name) > LONGEST or is_hidden(path.name) or not path.is_file():
            continue
        meant = next((file for file in absent if _is_like(path.name, file)), None)
        if meant is not None:
            place = (f"{name}/{path.name}", None, None)
            remedy = f"did you mean '{meant}'? Rename it; or give it a name that is not so similar"
            yield InputProblem(*place, "a file that is not read", f"the name {meant}", remedy)


def _is_like(name: str, file: str) -> bool:
    """Whether a file's name is that of a table, but for case, ending or a letter or two."""
    stem, ending = file.rpartition(".")[::2]
    written = name.casefold()
    for known in ENDINGS[f".{ending}"]:
        if written.endswith(known):
            found = written.removesuffix(known)
            exact = known == f".{ending}"
            return found == stem or (exact and _likeness(found, stem) >= LIKE)
    return False


def _likeness(one: str, other: str) -> float:
    """1 for equal names and for singular and plural, 0 for names with nothing in common."""
    plural = f"{one.removesuffix('y')}ies" if one.endswith("y") else f"{one}s"
    return 1.0 if plural == other else SequenceMatcher(None, one, other).ratio()
