"""Segments of the body by sex: de Leva's means of 100 men and 15 women, seen by gamma rays."""

from collections.abc import Mapping
from typing import Literal

from spinepipe.facts import numbers, several

Sex = Literal["male", "female"]

MASS_PERCENT: Mapping[str, float] = numbers(__name__, "segment_mass_percent")
"""Of body mass, by segment and sex (`hand male`); of arms one side."""

CENTRE: Mapping[str, float] = numbers(__name__, "segment_centre")
"""Centre of mass from the upper end of the head or an arm's segment, share of its length."""

LENGTH_M: Mapping[str, float] = numbers(__name__, "segment_length")
"""Of persons of `HEIGHT_M`."""

GYRATION: Mapping[str, tuple[float, ...]] = several(__name__, "segment_gyration")
"""Radii about the axes forwards, to the right and along the segment, shares of its length."""

HEIGHT_M: Mapping[str, float] = numbers(__name__, "segment_people_height")
"""Mean height, by sex."""


def length_m(segment: str, sex: Sex, height_m: float) -> float:
    """Of a person of this height: it grows with height."""
    return LENGTH_M[f"{segment} {sex}"] * height_m / HEIGHT_M[sex]


def mass_kg(segment: str, sex: Sex, body_kg: float) -> float:
    """Of a person of this body mass; of arms one side."""
    return MASS_PERCENT[f"{segment} {sex}"] / 100.0 * body_kg
