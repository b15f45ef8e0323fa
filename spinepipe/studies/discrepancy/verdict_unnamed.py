"""What a verdict says of a discrepancy that has no name: why, where, and what would describe it."""

from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """Why no name is given where something is missing."""

    NO_BASE = "no_base"
    DATA_ERRORS = "data_errors"
    NO_KNOWN_EFFECT = "no_known_effect"
    A_PART_STAYS = "a_part_stays"
    MOST_STAYS = "most_stays"
    IMITATED_TOGETHER = "imitated_together"
    NONE_KEEPS_ITS_PLACE = "none_keeps_its_place"
    STIFFNESS_OF_EACH_JOINT = "stiffness_of_each_joint"
    RIVALS_UNKNOWN = "rivals_unknown"
    NOT_PROVEN = "not_proven"


@dataclass(frozen=True)
class Tabulated:
    """Tables in the model file in the place of effects that have no name.

    Attributes
    ----------
    place : what is tabulated, and where, in words. gap : noise SD, in the fit with them.
    held_out_closed : share of the excess misfit (chi2) in readings left out that they take away;
        None where none tells.
    """

    place: str
    gap: float
    held_out_closed: float | None


@dataclass(frozen=True)
class UnnamedMisfit:
    """What is missing without a name.

    Attributes
    ----------
    where : the largest gaps, in words. shape : as generic shapes see it, None without evidence.
    reason : why there is no name. coordinate : of the shape; None without one.
    stays : noise SD (RMS) that stay whatever is added, where that is why; else None.
    """

    where: str
    shape: str | None
    reason: Reason
    coordinate: str | None = None
    stays: float | None = None


@dataclass(frozen=True)
class UnnamedRest:
    """What stays beside effects that are certain.

    Attributes
    ----------
    left_gap : noise SD, with the effects; None where it was not told.
    left_where : the largest gaps that stay, in words. left_shape : None without evidence.
    reasons : why it is not said that nothing else is missing.
    coordinate : of the shape; None without one.
    """

    left_gap: float | None
    left_where: str
    left_shape: str | None
    reasons: tuple[str, ...] = ()
    coordinate: str | None = None
