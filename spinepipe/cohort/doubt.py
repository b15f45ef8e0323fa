"""What is told of a sound cohort that is most likely wrong, and whether a run may start with it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from spinepipe.problems import Problem

Group = Literal["lengths", "postures", "masses", "loads", "motion", "zeroing", "errors", "persons"]
"""What can be meant though it looks wrong: ``i_mean_it`` in cohort.yaml."""

GROUPS: tuple[Group, ...] = get_args(Group)


@dataclass(frozen=True)
class Doubt:
    """One suspicion.

    Attributes
    ----------
    certain : it cannot be right; no run starts with it unless the cohort says that it is meant.
    """

    problem: Problem
    group: Group
    certain: bool = False

    @property
    def with_switch(self) -> Problem:
        """The problem, with what to write where it is meant."""
        told = self.problem
        remedy = f"{told.remedy} (if you mean it: i_mean_it: [{self.group}] in cohort.yaml)"
        place = (told.file, told.row, told.column)
        return Problem(*place, told.found, told.allowed, remedy)


class Found(NamedTuple):
    """Doubts of one sort, and the specimens that they are about."""

    doubts: tuple[Doubt, ...]
    specimens: frozenset[str]

    @classmethod
    def of(cls, doubts: Iterable[Doubt], specimens: Iterable[str]) -> "Found":
        """From anything that yields them."""
        return cls(tuple(doubts), frozenset(specimens))
