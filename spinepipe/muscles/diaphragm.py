"""What pressure in the abdomen does to the ribs: a lift ahead of T11 (Ghezelbash 2016, 2.8).

The paper prints no area of the diaphragm. Values differ twofold, and with them the moment that a
kilopascal makes, so each is here with its source.
"""

from dataclasses import dataclass

from spinepipe.effects.contract import Array
from spinepipe.muscles.masses import Load
from spinepipe.muscles.regressions import Regressions
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import THORAX

AHEAD_M = 0.05
"""How far ahead of T11 the diaphragm's force acts."""

_PA_PER_KPA = 1e3


@dataclass(frozen=True)
class Area:
    """A diaphragm area in m2, where it is from, and whether it was read there."""

    m2: float
    source: str
    status: str

    @property
    def nm_per_kpa(self) -> float:
        """Extension moment about T11 that each kilopascal makes, N m."""
        return _PA_PER_KPA * self.m2 * AHEAD_M


AREAS = {
    "cavity": Area(
        0.0452, "abdominal cavity as a circle of 0.12 m radius, AnyBody/ammr Buckle.any", "derived"
    ),
    "mcgill": Area(0.0243, "McGill and Norman 1987", "from_memory"),
    "morris": Area(0.0465, "Morris 1961", "from_memory"),
}
"""What the area may be for a person of reference size. 1.2 to 2.3 N m for each kPa."""

AREA_M2 = AREAS["cavity"].m2
"""Area for a person of reference size: the one whose source was read."""


def diaphragm_area(
    subject: Subject, reference: Subject, regressions: Regressions, area_m2: float = AREA_M2
) -> float:
    """A person's diaphragm, m2: it grows as the rib cage."""
    return area_m2 * regressions.row("rib_cage_area").ratio(subject, reference)


def diaphragm_load(pressure_pa: float, area_m2: float, t11: Array, turned: Array) -> Load:
    """Lift on the ribs along their own axis.

    Parameters
    ----------
    t11 : (3,) m, centre of T11 in the posture of the moment.
    turned : (3, 3) rotation of the thorax: its columns are forwards, up and right of T11.
    """
    lift: Array = pressure_pa * area_m2 * turned[:, 1]
    return Load("diaphragm", THORAX, lift, t11 + AHEAD_M * turned[:, 0])
