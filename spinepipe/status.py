"""How a solve ended: stored beside the numbers, with a message in plain words."""

from enum import StrEnum


class Status(StrEnum):
    """Outcome of an equilibrium, a settling run or a fit."""

    CONVERGED = "converged"
    CONVERGED_AT_BOUND = "converged_at_bound"
    UNSTABLE = "unstable"
    NOT_CONVERGED = "not_converged"
    REFUSED = "refused"

    @property
    def usable(self) -> bool:
        """Whether the numbers beside it are a solution."""
        return self in (Status.CONVERGED, Status.CONVERGED_AT_BOUND)


NOT_FITTED = "not_fitted"
"""Status of a stiffness that no reading of its fit depends on: there is no number of it."""

USABLE = tuple(status.value for status in Status if status.usable)
"""Status of rows whose numbers are a solution, as tables have it."""


def joined(*notes: str) -> str:
    """Notes as one message."""
    return "; ".join(note for note in notes if note)


class PrescribedStatus(StrEnum):
    """Outcome of holding a spine in a place (`spinepipe.statics.prescribed`)."""

    CONVERGED = "converged"
    UNSTABLE = "unstable"
    UNREACHABLE = "unreachable"
    NOT_CONVERGED = "not_converged"


class Balanced(StrEnum):
    """Outcome of finding the muscle forces of a trunk (`spinepipe.muscles.muscle_equilibrium`)."""

    CONVERGED = "converged"
    CONVERGED_ABOVE = "converged_above"
    BEYOND_STRENGTH = "beyond_strength"
    NOT_CONVERGED = "not_converged"
    CYCLING = "cycling"
    TWO_ANSWERS = "two_answers"
    OUT_OF_REACH = "out_of_reach"


HELD = (Balanced.CONVERGED.value, Balanced.CONVERGED_ABOVE.value)
"""Status of tasks whose numbers are a solution: within the stress that was asked for, or above."""
