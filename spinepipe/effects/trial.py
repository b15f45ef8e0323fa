"""How a search for missing effects may try an effect; an effect that says nothing is not tried."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Spread(StrEnum):
    """How the values of an effect may differ between the places it acts at."""

    SHARED = "shared"
    BY_JOINT = "by joint"
    BY_SPECIMEN = "by specimen"
    EACH = "each joint of each specimen"
    ONE_JOINT = "one joint"
    ONE = "one joint of one specimen"
    BY_TEST = "by test"


PER_JOINT = (
    Spread.SHARED,
    Spread.BY_JOINT,
    Spread.BY_SPECIMEN,
    Spread.EACH,
    Spread.ONE_JOINT,
    Spread.ONE,
)
"""All ways in which an effect of single joints may differ."""


@dataclass(frozen=True)
class Trial:
    """What is tried of an effect.

    Attributes
    ----------
    variants : options of each variant, alternatives of equal standing.
    spreads : how values may differ; effects that are not per joint know no joints.
    told_by : what a test must have to show the effect, in words.
    """

    variants: tuple[Mapping[str, Any], ...]
    spreads: tuple[Spread, ...]
    told_by: str
