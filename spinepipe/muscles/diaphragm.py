"""What pressure in the abdomen does to the ribs: a lift ahead of T11 (Ghezelbash 2016, 2.8).

The paper prints no area of the diaphragm, and values differ twofold (`facts.csv`): the one whose
source was read is taken.
"""

from spinepipe.effects.contract import Array
from spinepipe.facts import number
from spinepipe.muscles.masses import Load
from spinepipe.muscles.regressions import Regressions
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import THORAX

AHEAD_M = number(__name__, "diaphragm_ahead")
"""How far ahead of T11 the diaphragm's force acts."""

AREA_M2 = number(__name__, "diaphragm_area")
"""Area for a person of reference size."""


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
