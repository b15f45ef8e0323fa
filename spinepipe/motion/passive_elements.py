"""How joints resist motion by themselves: stiffening springs on six coordinates, with a band.

On each side of zero ``F = A (exp(B q) - 1)``, restoring load -F (Wang 2021 eq. 3, doi
10.1007/s10439-021-02774-3). Its stiffness is ``B (F + A)``: A B at rest, the same on both sides.
The generic values of Wang 2020 are printed nowhere, so `passive.csv` makes its own from two facts
for each joint and rotation, the stiffness k0 at rest and what the joint does at M = 7.5 N m:

- lumbar joints: the stiffness k1 there. B = (k1 - k0) / M, A = k0 / B. k0 is the slope at zero of
  the discs of Han 2010, k1 the segments of Schmidt 1998, who print one stiffness and no moment.
- thoracic joints: how far it turns there, q1 (Wilke 2017), and r = k1 / k0 (Mannen 2018 Table 2).
  B = log(r) / q1, A = M / (r - 1). T1T2 to T9T10 turn less by the rib cage, whose removal lets a
  thorax turn 59 to 64 % further (Mannen 2018); ribs 11 and 12 float.
- translations: sources print one stiffness k0, so the law hardly bends: B = 0.1 / mm, A = k0 / B.

`lower` and `upper` are factors of A and so of all loads. Upper is preload: 2.11 times at 500 N
(Gardner-Morse 2004). Lower is one SD of the specimens of Jaramillo (lumbar), or the largest range
of Wilke without the rib cage (thoracic).
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import (
    SIDES,
    coordinate_places,
    joint_places,
    packaged_rows,
    per_si,
    with_status,
)
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError, InputProblem
from spinepipe.units import COORDINATES, ROTATIONS

FILE = "passive.csv"
NUMBERS = ("a", "b", "lower", "upper")
"""a in N or N m; b in 1/mm or 1/deg; factors of a."""

SHAPE = (len(JOINTS), len(COORDINATES), len(SIDES))

LARGEST_B_PER_DEG = 2.0
"""Twice the steepest that comes along; rates per radian of joints that stiffen are above it."""

SLOPES_DIFFER = 0.01
"""Share by which a b may differ between the sides: what printing three digits does."""


@dataclass(frozen=True, eq=False)
class PassiveElements:
    """Laws of all joints.

    Attributes
    ----------
    a : (17, 6, 2) N or N m, of positive and of negative coordinates. b : (17, 6, 2) 1/m or 1/rad.
    lower, upper : (17, 6, 2) factors of a. source, status : (17, 6, 2) text of each.
    """

    a: Array
    b: Array
    lower: Array
    upper: Array
    source: NDArray[np.object_]
    status: NDArray[np.object_]

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).flags.writeable = False

    @property
    def sources(self) -> tuple[str, ...]:
        """All sources, each once."""
        return tuple(dict.fromkeys(self.source.ravel().tolist()))


def passive_elements(own: pd.DataFrame | None = None, file: str = FILE) -> PassiveElements:
    """The laws that come along, with a cohort's own rows in place of theirs.

    Parameters
    ----------
    own : sound rows of `passive.csv`, indexed by line; mm, deg, N, N m. None: what comes along.
    file : its name in messages.

    Raises
    ------
    InputError
        Of rates per radian, and of joints that have a kink at rest.
    """
    empty = np.full(SHAPE, np.nan)
    values = {name: empty.copy() for name in NUMBERS}
    words = {name: np.full(SHAPE, "", dtype=object) for name in ("source", "status")}
    for rows in [packaged_rows(FILE, NUMBERS), *([] if own is None else [with_status(own)])]:
        coordinate = coordinate_places(rows)
        side = np.array([SIDES.index(name) for name in rows["side"]], dtype=np.int64)
        at = joint_places(rows), coordinate, side
        for name in NUMBERS:
            values[name][at] = rows[name].to_numpy(float)
        values["b"][at] *= per_si(coordinate)
        for name, text in words.items():
            text[at] = rows[name].to_numpy(object)
    if own is not None and (problems := [*_steep(own, file), *_slopes(own, values, file)]):
        raise InputError(problems)
    return PassiveElements(**values, **words)


def _steep(own: pd.DataFrame, file: str) -> Iterator[InputProblem]:
    """Rates of rotations that are those of another unit."""
    steep = own["coordinate"].isin(ROTATIONS) & (own["b"] > LARGEST_B_PER_DEG)
    for line, rate in own["b"][steep].items():
        allowed = f"at most {LARGEST_B_PER_DEG:g} per degree"
        remedy = "rates per radian are divided by 57.3"
        yield InputProblem(file, int(str(line)), "b", f"{rate:g}", allowed, remedy)


def _slopes(own: pd.DataFrame, values: dict[str, Array], file: str) -> Iterator[InputProblem]:
    """Joints whose two sides begin with different stiffness: a kink no solver likes."""
    slope = values["a"] * values["b"]
    apart = np.abs(np.diff(slope, axis=-1)[..., 0]) > SLOPES_DIFFER * slope.max(axis=-1)
    places = zip(own.index, joint_places(own), coordinate_places(own), strict=True)
    for line, joint, coordinate in places:
        if apart[joint, coordinate]:
            positive, negative = slope[joint, coordinate] / per_si(np.array(coordinate))
            yield InputProblem(
                file,
                int(line),
                "a",
                f"a b is {positive:.4g} on the positive and {negative:.4g} on the negative side",
                "the same stiffness at rest on both sides",
                "give both sides, with the same product of a and b",
            )
