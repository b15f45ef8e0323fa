"""What a column of a testing machine means: its unit, and the direction in which it is positive.

Directions are told in the field's words. A moment or rotation towards flexion is a negative one
about z, a force or translation to posterior a negative one along x: the axes of the cohort folder.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from spinepipe.problems import did_you_mean

LOAD_COLUMNS = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
"""Columns of ``loads.csv`` that a channel can fill."""

LoadUnit = Literal["N", "kN", "N m", "N mm", "N cm", "Nm", "Nmm", "Ncm"]
MotionUnit = Literal["deg", "rad", "mm", "um", "m"]
TimeUnit = Literal["s", "ms", "min", "clock"]

Towards = Literal[
    "flexion",
    "extension",
    "right_bending",
    "left_bending",
    "right_rotation",
    "left_rotation",
    "anterior",
    "posterior",
    "superior",
    "inferior",
    "right",
    "left",
]

SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "min": 60.0, "clock": 1.0}

FORCES: Mapping[str, float] = {"N": 1.0, "kN": 1e3}
MOMENTS: Mapping[str, float] = {
    **{"N m": 1.0, "N mm": 1e-3, "N cm": 1e-2},
    **{"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2},
}
ANGLES: Mapping[str, float] = {"deg": 1.0, "rad": 57.29577951308232}
LENGTHS: Mapping[str, float] = {"mm": 1.0, "um": 1e-3, "m": 1e3}
"""Units by name: what one of them is in the unit of the cohort's columns (N, N m, deg, mm)."""


@dataclass(frozen=True)
class Direction:
    """A direction by its word.

    Attributes
    ----------
    load, motion : column of ``loads.csv`` and of ``motion.csv`` along which it lies.
    sign : 1 where it is the positive direction of these, else -1.
    """

    load: str
    motion: str
    sign: int

    @property
    def turns(self) -> bool:
        """Whether it is one of a moment and a rotation, not of a force and a translation."""
        return self.motion.endswith("_deg")


DIRECTIONS: Mapping[str, Direction] = {
    "anterior": Direction("fx_n", "anterior_mm", 1),
    "posterior": Direction("fx_n", "anterior_mm", -1),
    "superior": Direction("fy_n", "superior_mm", 1),
    "inferior": Direction("fy_n", "superior_mm", -1),
    "right": Direction("fz_n", "right_mm", 1),
    "left": Direction("fz_n", "right_mm", -1),
    "extension": Direction("mz_nm", "extension_deg", 1),
    "flexion": Direction("mz_nm", "extension_deg", -1),
    "right_bending": Direction("mx_nm", "right_bending_deg", 1),
    "left_bending": Direction("mx_nm", "right_bending_deg", -1),
    "left_rotation": Direction("my_nm", "left_rotation_deg", 1),
    "right_rotation": Direction("my_nm", "left_rotation_deg", -1),
}
"""Every direction by the word for it."""


def mistyped(name: str, names: Iterable[str], otherwise: str) -> str:
    """A remedy for an unknown column: the name that it is but for a slip of typing, if any.

    Short words, first and last letters tell axes and sides (`LB`, `MomentZ`, `right`, `posterior`):
    a name that differs there is another quantity, and is not offered.
    """
    return did_you_mean(name, [one for one in names if _sides(one) == _sides(name)], otherwise)


def _sides(name: str) -> list[str]:
    apart = re.sub("(?<=[a-z])(?=[A-Z])", " ", name).lower()
    words = re.findall(r"[^\W\d_]+|\d+", apart)
    return [word if len(word) < 4 else word[0] + word[-1] for word in words]


def factor_of(unit: str, positive: str) -> float:
    """What a reading of a channel is multiplied with to be in N, N m, deg or mm as columns say."""
    return DIRECTIONS[positive].sign * {**FORCES, **MOMENTS, **ANGLES, **LENGTHS}[unit]
