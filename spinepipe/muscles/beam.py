"""How stiff a joint of another size is: a disc as a short beam (Ghezelbash 2016, section 2.7).

Axial stiffness is E A / h and stiffness in rotation E I / h, with the same modulus E. The disc's
height h grows with body height, its area A with the area of the rib cage, and its area moment I
with the square of A.
"""

from dataclasses import dataclass

from spinepipe.facts import number
from spinepipe.muscles.regressions import Regressions
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import LEVELS, Trunk


@dataclass(frozen=True)
class Stiffening:
    """One disc beside another.

    Attributes
    ----------
    area, height : ratios of the discs.
    bending_times : what else multiplies bending forwards, backwards and sideways (ribs).
    """

    area: float
    height: float
    bending_times: float = 1.0

    @property
    def axial(self) -> float:
        """Ratio of stiffness in compression and in shear, A / h."""
        return self.area / self.height

    @property
    def torsion(self) -> float:
        """Ratio of stiffness in axial rotation, A^2 / h."""
        return self.area**2 / self.height

    @property
    def angular(self) -> float:
        """Ratio of stiffness in bending, A^2 / h, and what ribs add."""
        return self.bending_times * self.torsion


def stiffening(subject: Subject, reference: Subject, regressions: Regressions) -> Stiffening:
    """A person's joints beside the reference person's; the same at every level."""
    return Stiffening(
        regressions.row("rib_cage_area").ratio(subject, reference),
        subject.height_m / reference.height_m,
    )


RIBS = number(__name__, "bending_with_ribs")


def t11t12_beside_t12l1(trunk: Trunk, bending_times: float = RIBS) -> Stiffening:
    """Joint T11T12 beside T12L1 by the discs' area and height; ribs resist bending too."""
    upper, lower = LEVELS.index("T11T12"), LEVELS.index("T12L1")
    return Stiffening(
        float(trunk.disc_area[upper] / trunk.disc_area[lower]),
        float(trunk.disc_height[upper] / trunk.disc_height[lower]),
        bending_times,
    )
