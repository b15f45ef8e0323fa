"""How stiff a joint of another size is: a disc as a short beam (Ghezelbash 2016, section 2.7).

Axial stiffness is E A / h and stiffness in rotation E I / h, with the same modulus E. The disc's
height h grows with body height, its area A with the area of the rib cage, and its area moment I
with the square of A.
"""

from dataclasses import dataclass
from math import sqrt

from spinepipe.muscles.regressions import Regressions
from spinepipe.muscles.subject import REFERENCE, Subject
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


def t11t12_beside_t12l1(trunk: Trunk, bending_times: float = 1.2) -> Stiffening:
    """Joint T11T12 beside T12L1 by the discs' area and height; bending 20 % more for the ribs."""
    upper, lower = LEVELS.index("T11T12"), LEVELS.index("T12L1")
    return Stiffening(
        float(trunk.disc_area[upper] / trunk.disc_area[lower]),
        float(trunk.disc_height[upper] / trunk.disc_height[lower]),
        bending_times,
    )


@dataclass(frozen=True)
class StiffnessChange:
    """What a body height does to stiffness at a stated body mass index.

    Attributes
    ----------
    height_m : body height.
    axial_percent, angular_percent : change against the reference person.
    """

    height_m: float
    axial_percent: float
    angular_percent: float


def stiffness_change(
    height_m: float,
    regressions: Regressions,
    bmi: float = 25.0,
    reference: Subject = REFERENCE,
) -> StiffnessChange:
    """Change of joints for somebody of the reference sex and age with this height and BMI."""
    other = Subject(reference.sex, reference.age_years, height_m, bmi * height_m**2)
    changed = stiffening(other, reference, regressions)
    return StiffnessChange(height_m, 100.0 * (changed.axial - 1.0), 100.0 * (changed.angular - 1.0))


@dataclass(frozen=True)
class ImpliedAreas:
    """Ratio of disc areas that a pair of stiffness changes needs, found in three ways.

    All three are one number if the pair obeys beam theory: A = axial h, A = sqrt(angular h), and
    A = angular / axial, in which the disc's height drops out.
    """

    from_axial: float
    from_angular: float
    from_both: float

    def agree(self, within: float) -> bool:
        """Whether one area ratio does, to within a stated difference."""
        found = (self.from_axial, self.from_angular, self.from_both)
        return max(found) - min(found) <= within


def implied_areas(
    axial_percent: float, angular_percent: float, height_ratio: float
) -> ImpliedAreas:
    """Area ratios that a change of stiffness in per cent needs at a ratio of disc heights."""
    axial, angular = 1.0 + axial_percent / 100.0, 1.0 + angular_percent / 100.0
    return ImpliedAreas(axial * height_ratio, sqrt(angular * height_ratio), angular / axial)
