"""What is wrong with an input: one located sentence per problem, all problems at once."""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from heapq import nsmallest
from itertools import accumulate

__all__ = [
    "InputError",
    "InputProblem",
    "Spelling",
    "closest",
    "did_you_mean",
    "first_of",
    "nearest",
    "one_of",
]

LONGEST_FOUND = 160
"""Longer findings are cut: a message is read on a terminal."""

LONGEST_ALLOWED = 1500

MOST_LISTED = 60
"""Allowed names that are listed; beyond them their number is told."""


@dataclass(frozen=True)
class InputProblem:
    """One thing in one input file that must be changed by hand.

    Attributes
    ----------
    file : the file, as the user names it.
    row : line as an editor shows it (the header of a CSV is line 1); None for the whole file.
    column : column of a CSV, or dotted key of a YAML file; None for the whole row or file.
    found : what stands there.
    allowed : what may stand there.
    remedy : what to do.
    others : how many more have the same fault and are told in this line.
    rows : the lines of those.
    """

    file: str
    row: int | None
    column: str | None
    found: str
    allowed: str
    remedy: str
    others: int = 0
    rows: tuple[int, ...] = ()

    def __str__(self) -> str:
        """The problem as one line."""
        return "; ".join(self.lines)

    @property
    def lines(self) -> tuple[str, str]:
        """What stands where and may stand there; and what to do."""
        place = [_cut(self.file)]
        if self.row is not None:
            place.append(f"line {self.row}")
        if self.column is not None:
            place.append(_cut(self.column))
        found, remedy = _cut(self.found), _cut(self.remedy, LONGEST_ALLOWED)
        what = f"{', '.join(place)}: found {found}; allowed: {_cut(self.allowed, LONGEST_ALLOWED)}"
        if self.others:  # how many there are, and in which lines
            rows = f" row{'' if self.others == 1 else 's'} more: {_spans(self.rows)}"
            remedy += f"; and {self.others}{rows if self.rows else ' more'}"
        return " ".join(what.split()), " ".join(remedy.split())


MOST_SPANS = 5


def _spans(rows: Sequence[int]) -> str:
    """Numbers in order, those in a row as first-last; of many spans the first few and the last."""
    spans: list[list[int]] = []
    for row in sorted(set(rows)):
        if spans and row == spans[-1][1] + 1:
            spans[-1][1] = row
        else:
            spans.append([row, row])
    words = [str(low) if low == high else f"{low}-{high}" for low, high in spans]
    return ", ".join(
        words if len(words) <= MOST_SPANS else [*words[: MOST_SPANS - 1], "…", words[-1]]
    )


class InputError(Exception):
    """An input that cannot be used, with every problem found in it.

    Attributes
    ----------
    problems : tuple of Problem, without repetitions, in the order in which they were found; many
        that are alike are told in one, see `gathered`.
    """

    problems: tuple[InputProblem, ...]

    def __init__(self, problems: Iterable[InputProblem]) -> None:
        self.problems = gathered(dict.fromkeys(problems))
        super().__init__(self.problems)

    def __str__(self) -> str:
        """The number of problems and one line for each."""
        count = len(self.problems)
        head = f"{count} problem{'' if count == 1 else 's'} in the input"
        return "\n".join([f"{head}:", *(f"  {problem}" for problem in self.problems)])


MOST_MADE = 2000
"""Faults that one check of one input tells apart; a file with more is none of this kind."""


def first_of(found: Iterable[InputProblem]) -> Iterator[InputProblem]:
    """The first `MOST_MADE` problems, the last of them told as one of more."""
    before: InputProblem | None = None
    for number, problem in enumerate(found):
        if before is not None:
            yield before
        before = problem
        if number == MOST_MADE:
            remedy = f"{problem.remedy}; there are more than {MOST_MADE} faults: mend these first"
            before = replace(problem, remedy=remedy)
            break
    if before is not None:
        yield before


MOST_THE_SAME = 3
"""Rows with the very same fault that are told one by one; of more the first alone is."""

MOST_ALIKE = 10
"""Faults of one column alike but for names and numbers that are told one by one."""

MOST_OF_A_FILE = 100

MOST_CHARACTERS = 50_000
"""Of all problems of one input together."""


def gathered(problems: Iterable[InputProblem]) -> tuple[InputProblem, ...]:
    """Problems with a bound on their number: what is alike is counted, with its lines.

    Messages stay as long as a person reads, however many rows a file has.
    """
    found = list(problems)
    found = _told_in_one(
        found, lambda p: (p.file, p.column, p.found, p.allowed, p.remedy), MOST_THE_SAME, 1
    )
    found = _told_in_one(found, _likeness, MOST_ALIKE, MOST_ALIKE)
    found = _told_in_one(found, lambda p: p.file, MOST_OF_A_FILE, MOST_OF_A_FILE)
    # as many as fit into `MOST_CHARACTERS`, the last with the number of the others
    ends = accumulate(len(str(problem)) for problem in found)
    fit = max(sum(end <= MOST_CHARACTERS for end in ends), 1)
    if fit < len(found):
        rest = sum(1 + one.others for one in found[fit:])
        last = found[fit - 1]
        found = [*found[: fit - 1], replace(last, others=last.others + rest, rows=())]
    return tuple(found)


def _told_in_one(
    problems: list[InputProblem], alike: Callable[[InputProblem], Hashable], most: int, kept: int
) -> list[InputProblem]:
    """Of more than ``most`` problems that are alike the first ``kept``, the last with the rest."""
    keys = list(map(alike, problems))
    groups: dict[Hashable, list[InputProblem]] = defaultdict(list)
    for key, problem in zip(keys, problems, strict=True):
        groups[key].append(problem)
    told: list[InputProblem] = []
    met: Counter[Hashable] = Counter()
    for key, problem in zip(keys, problems, strict=True):
        met[key] += 1
        if len(groups[key]) <= most or met[key] < kept:
            told.append(problem)
        elif met[key] == kept:
            rest = groups[key][kept:]
            rows = [row for one in rest for row in ((one.row,) if one.row else ()) + one.rows]
            others = problem.others + sum(1 + one.others for one in rest)
            told.append(replace(problem, others=others, rows=(*problem.rows, *rows)))
    return told


_NAME_OR_NUMBER = re.compile(r"'[^']*'|[0-9][0-9.e+-]*")


def _likeness(problem: InputProblem) -> Hashable:
    """What problems have in common that differ in names and numbers alone."""
    found = _NAME_OR_NUMBER.sub("#", _cut(problem.found))
    keyed = problem.file.endswith(".csv")
    return problem.file, problem.column if keyed else None, found, problem.allowed


MOST_COMPARED = 300
"""Known names that an unknown one is compared with, those of the most similar length."""

LONGEST_COMPARED = 60
"""Characters of a name that is compared with others."""


def nearest(name: str, known: Iterable[str], number: int = 3) -> list[str]:
    """The known names that are most like ``name``, or the only one that begins with it."""
    if len(name) > LONGEST_COMPARED:
        return []
    names = [other for other in known if len(other) <= LONGEST_COMPARED]
    near = names
    if len(names) > MOST_COMPARED:
        near = nsmallest(MOST_COMPARED, names, key=lambda other: abs(len(other) - len(name)))
    longer = [other for other in names if other.startswith(name)]
    return get_close_matches(name, near, n=number, cutoff=0.6) or longer * (len(longer) == 1)


def closest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is most like ``name``, or the only one that begins with it."""
    return next(iter(nearest(name, known, 1)), None)


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """A remedy for an unknown name: the closest known one, or what else to do."""
    match = closest(name, known)
    return f"did you mean '{match}'?" if match else otherwise


class Spelling:
    """Remedies for unknown names in many rows; each name is looked up once, and only the first few.

    More are not told one by one, see `gathered`.
    """

    def __init__(self, known: Iterable[str], otherwise: str) -> None:
        """``known``, ``otherwise`` : as `did_you_mean` takes them."""
        self.known = tuple(known)
        self._otherwise = otherwise
        self._found: dict[str, str] = {}
        self.allowed = one_of(self.known)

    def remedy(self, name: str) -> str:
        """What to do about an unknown name."""
        if name not in self._found and len(self._found) < 2 * MOST_ALIKE:
            self._found[name] = did_you_mean(name, self.known, self._otherwise)
        return self._found.get(name, self._otherwise)


def one_of(names: Iterable[str]) -> str:
    """The allowed names as text; of very many the first ones and their number."""
    listed = list(names)
    rest = len(listed) - MOST_LISTED
    more = f" and {rest} more" if rest > 0 else ""
    return "one of " + ", ".join(listed[:MOST_LISTED]) + more if listed else "none"


def _cut(text: str, longest: int = LONGEST_FOUND) -> str:
    return text if len(text) <= longest else text[: longest - 3] + "..."
