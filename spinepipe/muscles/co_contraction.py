"""The least tone that makes a posture stable."""

from dataclasses import dataclass

from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, held
from spinepipe.muscles.person import Person
from spinepipe.muscles.stability import smallest_eigenvalue
from spinepipe.muscles.task import Task
from spinepipe.status import Balanced

LARGEST_TONE = 0.2
"""Up to which tone is looked for: every muscle at a fifth of its strength, beside the task."""

_FIRST, _HALVINGS = 0.00125, 6


@dataclass(frozen=True, eq=False)
class CoContraction:
    """A task held with tone.

    Attributes
    ----------
    tone : least activation of every muscle, share of its largest.
    eigenvalue : N m/rad, below nought where the posture falls over.
    """

    held: SolvedTask
    tone: float
    eigenvalue: float

    @property
    def stands(self) -> bool:
        """Whether it is held and does not fall over."""
        return self.held.status is Balanced.CONVERGED and self.eigenvalue >= 0.0


def toned(
    person: Person, task: Task, how: SolverOptions, gain: float, tone: float
) -> CoContraction:
    """The task with a tone; raises as `held` does."""
    found = held(person, task, how, tone)
    return CoContraction(found, tone, smallest_eigenvalue(person, found, gain))


def least_stable(
    person: Person, task: Task, how: SolverOptions, gain: float
) -> CoContraction | None:
    """The least tone that is stable, to a sixtieth of it; None where none is or can be held.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    none = toned(person, task, how, gain, 0.0)
    if none.stands:
        return none
    low, high = 0.0, _FIRST
    best = toned(person, task, how, gain, high)
    while not best.stands:
        low, high = high, min(2.0 * high, LARGEST_TONE)
        if low == LARGEST_TONE or best.held.status is not Balanced.CONVERGED:
            return None
        best = toned(person, task, how, gain, high)
    for _ in range(_HALVINGS):
        middle = toned(person, task, how, gain, 0.5 * (low + high))
        if middle.stands:
            high, best = middle.tone, middle
        else:
            low = middle.tone
    return best
