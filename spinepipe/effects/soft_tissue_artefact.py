"""Soft tissue artefact: markers on skin follow a neighbouring joint, until the skin is taut.

Of one coordinate, with q the true motion of the joint, u that of the joint above or below (both m,
or rad) and s the share, the reading is ``q + s slip(u)``: for s > 0 it moves to the side to which
the neighbour moves. `slip` keeps the sign of u and never exceeds the reach, so that at most s times
the reach is read besides. The effect changes readings alone, no load and no pose. Above the
uppermost joint and below the lowest one nothing moves: u is 0 there.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, MeasurementContext, Observation, Parameter
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.units import COORDINATES, TRANSLATIONS

NEIGHBOURS = ("above", "below")

_REACH = {  # smallest, usual and largest slip
    True: (1e-4, 1e-3, 5e-3),
    False: tuple(float(np.deg2rad(deg)) for deg in (0.1, 2.0, 8.0)),
}
"""Bounds and default of the reach: of translations (True) m, of rotations (False) rad."""


@register("soft_tissue_artefact")
@dataclass(frozen=True)
class SoftTissueArtefact:
    """One coordinate is read with a share of what the neighbouring joint does: ``q + s slip(u)``.

    u is the same coordinate of the joint above (or below), and skin slips with it only so far:
    ``slip(u) = u / sqrt(1 + (u / reach)^2)``, which is u while small and the reach in the end. A
    share of zero is off. Slip without end, a straight share of the neighbour's motion, could as
    well be tissue that spans two joints: a fit whose reach runs to its bound is no artefact.
    """

    coordinate: str = "extension"
    neighbour: str = "above"

    name: ClassVar[str] = "soft_tissue_artefact"
    kind: ClassVar[EffectKind] = EffectKind.MEASUREMENT
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c, "neighbour": n} for c in COORDINATES for n in NEIGHBOURS),
        spreads=(PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN),
        told_by="several joints read over several load steps up to a large motion",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "neighbour", self.neighbour, NEIGHBOURS)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The share s, which has no unit, and the reach, m of a translation, rad of a rotation."""
        moves = self.coordinate in TRANSLATIONS
        low, usual, high = _REACH[moves]
        share = f"share of {self.coordinate} of the joint {self.neighbour} that is read besides"
        reach = "reading besides at which the skin is taut"
        return (
            Parameter("share", "1", 0.0, 2.0, 0.3, 0.3, False, share, off=0.0),
            Parameter("reach", "m" if moves else "rad", low, high, usual, 0.7, True, reach),
        )

    def observe_beside(
        self, q: Array, parameters: Array, beside: MeasurementContext
    ) -> Observation:
        """Reported coordinates (J, 6), with derivatives by the joint's own and the neighbour's.

        Parameters
        ----------
        q : (J, 6) true coordinates, m and rad. parameters : (J, 2) share and reach of each joint.
        beside : true coordinates of the joints above and below each.
        """
        share, u, root = self._slip(parameters, beside)
        seen, by_other = q.copy(), np.zeros((len(q), 6, 6))
        seen[:, self._at] += share * u / root
        by_other[:, self._at, self._at] = share / root**3  # d slip / du = 1 / root^3
        own = np.tile(np.eye(6), (len(q), 1, 1))
        if self.neighbour == "above":
            return Observation(seen, own, by_above=by_other)
        return Observation(seen, own, by_below=by_other)

    def by_parameter_beside(self, q: Array, parameters: Array, beside: MeasurementContext) -> Array:
        """(J, 6, 2) derivative of the reported coordinates by share and reach."""
        share, u, root = self._slip(parameters, beside)
        found = np.zeros((len(q), 6, 2))
        found[:, self._at, 0] = u / root
        # d slip / d reach = (u / (reach root))^3
        found[:, self._at, 1] = share * (u / root) ** 3 / parameters[:, 1] ** 3
        return found

    @property
    def _at(self) -> int:
        """Place of the coordinate among the six."""
        return COORDINATES.index(self.coordinate)

    def _slip(self, parameters: Array, beside: MeasurementContext) -> tuple[Array, Array, Array]:
        """(J,) each: share; motion u of the neighbour, m or rad; ``sqrt(1 + (u / reach)^2)``."""
        u = (beside.above if self.neighbour == "above" else beside.below)[:, self._at]
        return parameters[:, 0], u, np.sqrt(1.0 + (u / parameters[:, 1]) ** 2)
