"""Coupling: a joint that moves in one coordinate is loaded in another."""

from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.units import COORDINATES, TRANSLATIONS

# Typical size and bound by the number of translations in the pair. Rotations: a fifth of the
# stiffness in lateral bending (Gould 2024b Table 2: 69 N m/rad).
_SIZES = {0: ("N m/rad", 15.0, 1e4), 1: ("N/rad", 1e3, 1e7), 2: ("N/m", 3e4, 1e9)}


@register("bending_rotation_coupling")
@dataclass(frozen=True)
class BendingRotationCoupling:
    """Adds ``load_i = c q_j`` and ``load_j = c q_i`` for a pair of coordinates; zero is off.

    One symmetric pair of off-diagonal terms of the joint's stiffness matrix, as measured in
    lumbar joints by Gardner-Morse and Stokes 2004 (J Biomech 37:205). A positive coupling of
    bending and rotation turns the joint to the right when it bends to the right.
    """

    pair: tuple[str, str] = ("right_bending", "left_rotation")
    name: ClassVar[str] = "bending_rotation_coupling"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    straight_over: ClassVar[float] = np.inf
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"pair": pair} for pair in combinations(COORDINATES, 2)),
        spreads=PER_JOINT,
        told_by="motion measured in both coordinates while one of them is loaded",
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "pair", tuple(self.pair))  # a model file holds a list
        if len(self.pair) != 2 or self.pair[0] == self.pair[1]:
            raise ValueError(f"{self.name}: pair {list(self.pair)} is not two coordinates")
        for coordinate in self.pair:
            require(self.name, "pair", coordinate, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The coupling stiffness alone."""
        unit, size, most = _SIZES[sum(name in TRANSLATIONS for name in self.pair)]
        meaning = f"load in {self.pair[0]} by {self.pair[1]}, and the other way round"
        return (Parameter("coupling", unit, -most, most, size, size, False, meaning, off=0.0),)

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and its symmetric tangent (J, 6, 6)."""
        there, back = self._columns
        tangent = np.zeros((*q.shape, 6))
        tangent[:, there, back] = parameters
        return JointResponse(np.einsum("jab,jb->ja", tangent, q), tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 1): each load moves with the other coordinate."""
        there, back = self._columns
        derivative = np.zeros((*q.shape, 1))
        derivative[:, there, 0] = q[:, back]
        return derivative

    @property
    def _columns(self) -> tuple[list[int], list[int]]:
        there = [COORDINATES.index(name) for name in self.pair]
        return there, there[::-1]
