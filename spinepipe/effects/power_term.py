"""Power term: a load that is a product of powers of the joint's motions, one term of a formula."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import register
from spinepipe.facts import several
from spinepipe.units import COORDINATES, TRANSLATIONS

MOST_FACTORS = 4

_ROTATION, _TRANSLATION = several(__name__, "usual_motion").values()
"""How far a lumbar joint has moved under which load."""


@register("power_term")
@dataclass(frozen=True)
class PowerTerm:
    """Adds ``coefficient`` times the product of the motions ``of`` the joint on one coordinate.

    A motion named twice counts twice: ``[extension, extension]`` is its square. With ``signed`` the
    last one counts by its size, so that ``[extension, extension]`` is ``q |q|``. Terms of more than
    the loaded coordinate have no potential unless their partners are there as well. Zero is off.
    """

    coordinate: str = "extension"
    of: tuple[str, ...] = ("extension", "extension")
    signed: bool = False
    name: ClassVar[str] = "power_term"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "of", tuple(self.of))  # a model file has lists
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        if not 1 <= len(self.of) <= MOST_FACTORS:
            raise ValueError(f"{self.name}: of {list(self.of)} is not 1 to {MOST_FACTORS} motions")
        for one in self.of:
            require(self.name, "of", one, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The coefficient alone."""
        size = _TRANSLATION[1] if self.coordinate in TRANSLATIONS else _ROTATION[1]
        for one in self.of:
            size /= _TRANSLATION[0] if one in TRANSLATIONS else _ROTATION[0]
        meaning = f"load in {self.coordinate} by {' x '.join(self.of)}"
        most = 1e4 * size
        # N or N m by m and rad
        metres = sum(one in TRANSLATIONS for one in self.of)
        powers = {"m": metres, "rad": len(self.of) - metres}
        below = [n if power == 1 else f"{n}^{power}" for n, power in powers.items() if power]
        above = "N" if self.coordinate in TRANSLATIONS else "N m"
        unit = f"{above}/{below[0]}" if len(below) == 1 else f"{above}/({' '.join(below)})"
        return (Parameter("coefficient", unit, -most, most, 0.0, size, False, meaning, off=0.0),)

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6)."""
        at = COORDINATES.index(self.coordinate)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        value, slopes = self._product(q)
        load[:, at] = parameters[:, 0] * value
        tangent[:, at] = parameters * slopes
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 1) by the coefficient."""
        derivative = np.zeros((*q.shape, 1))
        derivative[:, COORDINATES.index(self.coordinate), 0], _ = self._product(q)
        return derivative

    def _product(self, q: Array) -> tuple[Array, Array]:
        """The product (J,) and its slopes by all coordinates (J, 6)."""
        columns = [COORDINATES.index(one) for one in self.of]
        factors, rises = q[:, columns].copy(), np.ones((len(q), len(columns)))
        if self.signed:
            rises[:, -1] = np.sign(factors[:, -1])
            factors[:, -1] = np.abs(factors[:, -1])
        slopes = np.zeros_like(q)
        for number, column in enumerate(columns):
            rest = np.prod(np.delete(factors, number, axis=1), axis=1)
            slopes[:, column] += rises[:, number] * rest
        return np.prod(factors, axis=1), slopes
