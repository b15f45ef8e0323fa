"""Numbers of others: rows of `facts.csv` beside the module that asks, each with its source.

Columns: `fact`; `of`, what or whom it is a fact of (a level, a sex; empty: there is one);
`values`, one number or several with blanks between them, in `unit`; `status`, how sure it is;
`source`, `doi` and `place` (table, figure, section); `note`. What an algorithm needs (tolerances,
steps) is no fact and stands in its code.

A result hangs on the rows whose `fact` its code names, and on none of their words
(`spinepipe.jobs.code`): so a name is written out where it is asked for.
"""

import csv
from functools import cache
from importlib.resources import files

FILE = "facts.csv"

STATUSES = ("confirmed", "derived", "from_memory", "choice")
"""Read in the source; worked out from such; in no text at hand, and never used to accept a result;
an estimate of our own, with no source at all."""


def number(module: str, fact: str) -> float:
    """A fact of which there is one number; `module` is the `__name__` of who asks."""
    return numbers(module, fact)[""]


def numbers(module: str, fact: str) -> dict[str, float]:
    """A fact's number by what it is of, in the order of the file.

    Raises
    ------
    ValueError
        Where a row has several numbers.
    """
    return {of: value for of, (value,) in several(module, fact).items()}


def several(module: str, fact: str) -> dict[str, tuple[float, ...]]:
    """A fact's numbers by what they are of, in the order of the file.

    Raises
    ------
    KeyError
        Where the file beside the module has no such fact.
    """
    return dict(_facts(module.rpartition(".")[0])[fact])


@cache
def _facts(package: str) -> dict[str, dict[str, tuple[float, ...]]]:
    """Numbers of a folder by fact and by what they are of."""
    found: dict[str, dict[str, tuple[float, ...]]] = {}
    with files(package).joinpath(FILE).open(encoding="utf-8") as text:
        for row in csv.DictReader(text):
            values = tuple(map(float, row["values"].split()))
            found.setdefault(row["fact"], {})[row["of"]] = values
    return found
