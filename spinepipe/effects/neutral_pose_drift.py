"""Neutral pose drift: the zero of the readings moves on while a test goes on.

An error of measurement: a reading is the true coordinate plus drift times g, m or rad. A positive
drift reads too far towards the positive side of the coordinate. Zeroing readings at the first step
takes nothing off it, since g is 0 there.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, MeasurementContext, Observation, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.units import COORDINATES, TRANSLATIONS

_DRIFT = {True: (1e-2, 3e-4), False: (0.2, float(np.deg2rad(0.3)))}
"""Drift over a whole test, m of a translation (True) and rad of a rotation (False).

First the bound, on both sides of zero (10 mm; 0.2 rad, 11.5 deg), then the typical one (0.3 mm;
0.3 deg), which is the default and the SD of the prior. `facts.csv` has no source for them.
"""


@register("neutral_pose_drift")
@dataclass(frozen=True)
class NeutralPoseDrift:
    """One coordinate is read too large by ``drift g(s)``, s the share of the test that has passed.

    s counts by the recorded time, else by the load steps: 0 at the first, 1 at the last.
    ``g = (1 - exp(-s / pace)) / (1 - exp(-1 / pace))`` is even for a large pace, and early for a
    small one, as when a clamp settles. What is read drifts whatever the load: joints do not move. A
    drift of zero is off.
    """

    coordinate: str = "extension"

    name: ClassVar[str] = "neutral_pose_drift"
    kind: ClassVar[EffectKind] = EffectKind.MEASUREMENT
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in COORDINATES),
        spreads=PER_JOINT,
        told_by="tests that come back to loads they have had before, best to none at their end",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The drift over a test, and its pace."""
        moves = self.coordinate in TRANSLATIONS
        largest, typical = _DRIFT[moves]
        drift = f"what the reading of {self.coordinate} is too large by at the end of a test"
        pace = "share of the test over which most of the drift comes; large: it is even"
        return (
            Parameter(
                "drift",
                "m" if moves else "rad",
                -largest,
                largest,
                typical,
                typical,
                False,
                drift,
                off=0.0,
            ),
            Parameter("pace", "1", 0.05, 20.0, 1.0, 1.5, True, pace, family=True),
        )

    def observe_beside(
        self, q: Array, parameters: Array, beside: MeasurementContext
    ) -> Observation:
        """Reported coordinates (J, 6), m and rad; their derivative by the true ones is one."""
        seen = q.copy()
        seen[:, self._at] += parameters[:, 0] * _course(beside.passed, parameters[:, 1])[0]
        return Observation(seen, np.tile(np.eye(6), (len(q), 1, 1)))

    def by_parameter_beside(self, q: Array, parameters: Array, beside: MeasurementContext) -> Array:
        """(J, 6, 2) derivative of the reported coordinates by drift and by pace."""
        course, by_pace = _course(beside.passed, parameters[:, 1])
        found = np.zeros((len(q), 6, 2))
        found[:, self._at, 0] = course
        found[:, self._at, 1] = parameters[:, 0] * by_pace
        return found

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)


def _course(passed: Array, pace: Array) -> tuple[Array, Array]:
    """(J,) share g of the drift that has come, and its derivative by the pace.

    Parameters
    ----------
    passed : (J,) share s of the test that has passed, 0 to 1. pace : (J,) share of the test.
    """
    # g = now / whole; by the chain rule the derivative of each by pace has 1 / pace^2, put last
    now, whole = -np.expm1(-passed / pace), -np.expm1(-1.0 / pace)
    by_now, by_whole = -passed * np.exp(-passed / pace), -np.exp(-1.0 / pace)
    return now / whole, (by_now / whole - now * by_whole / whole**2) / pace**2
