"""What may be wrong in the files and not in the model: a mistake that a person should look for."""

from collections.abc import Iterable
from dataclasses import dataclass

ALL = "all specimens"


@dataclass(frozen=True)
class SuspectedError:
    """A mistake that the data point to; nothing is corrected.

    Attributes
    ----------
    where : specimens, and joint, coordinate or test. what : the mistake. evidence : with numbers.
    """

    where: str
    what: str
    evidence: str


def of_specimens(names: Iterable[str], every: Iterable[str]) -> str:
    """Specimens in words; all of them by one word where there are several."""
    chosen, known = list(names), list(every)
    return ALL if len(known) > 1 and set(chosen) == set(known) else ", ".join(chosen)
