"""Bounded tangent: resistance to one rotation grows without limit towards two ends."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import register
from spinepipe.facts import number
from spinepipe.units import COORDINATES, ROTATIONS

_END_RAD = number(__name__, "tangent_end")
_STRETCH_NM = number(__name__, "tangent_stretch")


@register("bounded_tangent")
@dataclass(frozen=True)
class BoundedTangent:
    """Adds ``A (tan(B q + C) + D)`` on one rotation; a stretch A of zero is off.

    B, C and D follow from the two ends: the argument is -pi/2 at the lower and pi/2 at the upper
    one, and the load is zero at q = 0. The ends are never reached; a pose beyond one of them is
    none, and the load there is infinite. Jalalian 2017 eqs. 1 to 3 (DOI
    10.1007/s11517-016-1576-8), whose left rotations are our negative right bendings.
    """

    coordinate: str = "right_bending"
    name: ClassVar[str] = "bounded_tangent"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, ROTATIONS)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stretch A, and the two ends."""
        stretch = f"load in {self.coordinate} by which the tangent is stretched"
        lower, upper = (f"{which} end of {self.coordinate}" for which in ("lower", "upper"))
        end, size = _END_RAD, _STRETCH_NM
        return (
            Parameter("stretch", "N m", 0.0, 1e5, size, size, False, stretch, off=0.0),
            Parameter("lower_end", "rad", -1.3, -1e-4, -end, 0.5 * end, False, lower),
            Parameter("upper_end", "rad", 1e-4, 1.3, end, 0.5 * end, False, upper),
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6); infinite beyond the ends."""
        at, law = COORDINATES.index(self.coordinate), _Law(parameters)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at], tangent[:, at, at] = law.load(q[:, at])
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 3) by the stretch and the ends."""
        at = COORDINATES.index(self.coordinate)
        derivative = np.zeros((*q.shape, 3))
        derivative[:, at] = _Law(parameters).by_parameter(q[:, at])
        return derivative


class _Law:
    """The law of J joints."""

    def __init__(self, parameters: Array) -> None:
        self.stretch, self.lower, self.upper = parameters.T
        self.b, self.c = argument(self.lower, self.upper)

    def load(self, q: Array) -> tuple[Array, Array]:
        """Load (J,) and its slope (J,)."""
        inside = (q > self.lower) & (q < self.upper)
        tan, tan_0 = np.tan(self.b * q + self.c), np.tan(self.c)
        load = self.stretch * (tan - tan_0)
        slope = self.stretch * self.b * (1.0 + tan**2)
        beyond = ~inside & (self.stretch > 0.0)
        load[beyond] = np.copysign(np.inf, q[beyond])
        slope[beyond] = np.inf
        return load, slope

    def by_parameter(self, q: Array) -> Array:
        """(J, 3)"""
        tan, tan_0 = np.tan(self.b * q + self.c), np.tan(self.c)
        by_b, by_c = 1.0 + tan**2, 1.0 + tan_0**2
        columns = [tan - tan_0]
        for sign in (1.0, -1.0):  # by the lower, and by the upper end
            b = sign * self.b**2 / np.pi
            c = -0.5 * (b * (self.lower + self.upper) + self.b)
            columns.append(self.stretch * (by_b * (b * q + c) - by_c * c))
        return np.stack(columns, axis=1)


def argument(lower: Array, upper: Array) -> tuple[Array, Array]:
    """B and C of the argument B q + C, -pi/2 at the lower and pi/2 at the upper end."""
    b = np.pi / (upper - lower)
    return b, -0.5 * b * (lower + upper)
