"""What is wrong with an input: one located sentence per problem, all problems at once."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches

__all__ = ["InputError", "Problem", "closest", "did_you_mean", "one_of"]

LONGEST_FOUND = 160
"""Longer findings are cut: a message is read on a terminal."""


@dataclass(frozen=True)
class Problem:
    """One thing in one input file that must be changed by hand.

    Attributes
    ----------
    file : the file, as the user names it.
    row : line as an editor shows it (the header of a CSV is line 1); None for the whole file.
    column : column of a CSV, or dotted key of a YAML file; None for the whole row or file.
    found : what stands there.
    allowed : what may stand there.
    remedy : what to do.
    """

    file: str
    row: int | None
    column: str | None
    found: str
    allowed: str
    remedy: str

    def __str__(self) -> str:
        """The problem as one line."""
        place = [self.file]
        if self.row is not None:
            place.append(f"line {self.row}")
        if self.column is not None:
            place.append(self.column)
        text = (
            f"{', '.join(place)}: found {_cut(self.found)}; allowed: {self.allowed}; {self.remedy}"
        )
        return " ".join(text.split())


class InputError(Exception):
    """An input that cannot be used, with every problem found in it.

    Attributes
    ----------
    problems : tuple of Problem, without repetitions, in the order in which they were found.
    """

    problems: tuple[Problem, ...]

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(dict.fromkeys(problems))
        super().__init__(self.problems)

    def __str__(self) -> str:
        """The number of problems and one line for each."""
        count = len(self.problems)
        head = f"{count} problem{'' if count == 1 else 's'} in the input"
        return "\n".join([f"{head}:", *(f"  {problem}" for problem in self.problems)])


def closest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is most like ``name``, or the only one that begins with it."""
    names = list(known)
    matches = get_close_matches(name, names, n=1, cutoff=0.6)
    longer = [other for other in names if other.startswith(name)]
    if not matches and len(longer) == 1:
        return longer[0]
    return matches[0] if matches else None


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """A remedy for an unknown name: the closest known one, or what else to do."""
    match = closest(name, known)
    return f"did you mean '{match}'?" if match else otherwise


def one_of(names: Iterable[str]) -> str:
    """The allowed names as text."""
    listed = list(names)
    return "one of " + ", ".join(listed) if listed else "none"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST_FOUND else text[: LONGEST_FOUND - 3] + "..."
