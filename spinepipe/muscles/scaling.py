"""A trunk made to a person's size (Ghezelbash 2016, section 2.7).

Bones, discs, head, shoulders and arms grow with body height about the centre of L5S1; so do the
heights of muscle points and the fibres. How far a muscle point lies ahead of the line of vertebrae
and beside it, and the cross-section of a fascicle, follow regressions of that muscle at that
level. Areas of discs and of the diaphragm follow that of the rib cage.

A joint is as stiff as its disc as a short beam: E A / h along it and E I / h in rotation, with the
same modulus E. The disc's height h grows with body height, its area A with the area of the rib
cage, and its area moment I with the square of A.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.facts import number
from spinepipe.muscles.regressions import REGRESSION_LEVELS, Quantity, Regression, Regressions
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.trunk import LEVELS, NO_BODY, RECTUS, Trunk

_L5S1 = 0
_X, _Y, _Z = range(3)

DIAPHRAGM_M2 = number(__name__, "diaphragm_area")
"""Of a person of reference size. The paper prints none, and values differ twofold (`facts.csv`):
the one whose source was read is taken."""

DIAPHRAGM_AHEAD_M = number(__name__, "diaphragm_ahead")
"""How far ahead of T11 its force acts, whatever the person's size."""

RIBS = number(__name__, "bending_with_ribs")


@dataclass(frozen=True)
class ScaleFactors:
    """What is multiplied beside the rules of scaling.

    Attributes
    ----------
    pcsa_times : factor of all cross-sections of muscles.
    disc_area_times : factor of all disc areas, for what is not known of the source's discs. It
        moves disc pressure; stiffness was measured, so it does not follow.
    """

    pcsa_times: float = 1.0
    disc_area_times: float = 1.0


def scale_trunk(
    trunk: Trunk,
    subject: Subject,
    reference: Subject,
    regressions: Regressions,
    factors: ScaleFactors = ScaleFactors(),
) -> Trunk:
    """The trunk of a person, from that of the reference person.

    Parameters
    ----------
    trunk : of the reference person, in the source's pose.
    subject, reference : the person, and whom the trunk is of.
    regressions : of muscles and the rib cage.
    factors : what is multiplied beside them.

    Raises
    ------
    ValueError
        If a regression is not positive for the person.
    """
    size = _SizeRatios(trunk, subject, reference, regressions)
    tall, muscles = size.height, trunk.muscles
    area = size.of_row(regressions.row("rib_cage_area"))
    return replace(
        trunk,
        joints=tall * trunk.joints,
        disc_height=tall * trunk.disc_height,
        disc_area=factors.disc_area_times * area * trunk.disc_area,
        vertebrae=tall * trunk.vertebrae,
        head=tall * trunk.head,
        shoulders=tall * trunk.shoulders,
        arm_length=tall * trunk.arm_length,
        sheath=size.place(trunk.sheath, np.full(trunk.sheath.shape[:-1], RECTUS)),
        muscles=replace(
            muscles,
            pcsa=factors.pcsa_times * size.pcsa() * muscles.pcsa,
            fibre=tall * muscles.fibre,
            point=np.where(
                (muscles.body != NO_BODY)[..., None],
                size.place(muscles.point, size.movers),
                muscles.point,
            ),
        ),
    )


@dataclass(frozen=True)
class Ratio:
    """One ratio that scaling uses; `of` is all, a muscle, or a muscle at a level."""

    quantity: str
    of: str
    ratio: float
    source: str


def applied_ratios(
    trunk: Trunk, subject: Subject, reference: Subject, regressions: Regressions
) -> tuple[Ratio, ...]:
    """Every ratio that makes the person differ from the reference person, each once."""
    paper = "Ghezelbash 2016, section 2.7"
    size = _SizeRatios(trunk, subject, reference, regressions)
    found = [Ratio("lengths and disc heights", "all", size.height, f"{paper}: body height")]
    found += [Ratio(row.quantity, row.of, size.of_row(row), row.source) for row in size.rows()]
    joints = beam_ratios(subject, reference, regressions)
    area = regressions.row("rib_cage_area")
    found += [
        Ratio("disc_area", "all", joints.area, f"{paper}: as the rib cage. {area.source}"),
        Ratio("axial_stiffness", "all", joints.axial, f"{paper}: beam, area / height"),
        Ratio("angular_stiffness", "all", joints.angular, f"{paper}: beam, area^2 / height"),
    ]
    return tuple(found)


@dataclass(frozen=True)
class BeamRatios:
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


def beam_ratios(subject: Subject, reference: Subject, regressions: Regressions) -> BeamRatios:
    """A person's joints beside the reference person's; the same at every level."""
    return BeamRatios(
        regressions.row("rib_cage_area").ratio(subject, reference),
        subject.height_m / reference.height_m,
    )


def t11t12_over_t12l1(trunk: Trunk, bending_times: float = RIBS) -> BeamRatios:
    """Joint T11T12 beside T12L1 by the discs' area and height; ribs resist bending too."""
    upper, lower = LEVELS.index("T11T12"), LEVELS.index("T12L1")
    return BeamRatios(
        float(trunk.disc_area[upper] / trunk.disc_area[lower]),
        float(trunk.disc_height[upper] / trunk.disc_height[lower]),
        bending_times,
    )


def diaphragm_area(subject: Subject, reference: Subject, regressions: Regressions) -> float:
    """A person's diaphragm, m2."""
    return DIAPHRAGM_M2 * regressions.row("rib_cage_area").ratio(subject, reference)


def nearest_vertebra(trunk: Trunk, height: Array) -> NDArray[np.int64]:
    """Index into REGRESSION_LEVELS of the vertebra whose centre is nearest in height, m.

    The centre of L5S1 stands for S1.
    """
    nodes = np.append(trunk.vertebrae[:, _Y], trunk.joints[_L5S1, _Y])
    found: NDArray[np.int64] = np.abs(np.asarray(height)[..., None] - nodes).argmin(axis=-1)
    return found


def line_of_vertebrae(trunk: Trunk, height: Array) -> Array:
    """(..., 3) m, point of the line through L5S1 and the vertebrae's centres at each height.

    Straight down from L5S1 and straight up from T1.
    """
    nodes = np.vstack([trunk.joints[_L5S1], trunk.vertebrae[::-1]])
    ahead, aside = (np.interp(height, nodes[:, _Y], nodes[:, axis]) for axis in (_X, _Z))
    return np.stack([ahead, np.asarray(height, dtype=float), aside], axis=-1)


class _SizeRatios:
    """A person's size beside the reference person's, each ratio worked out once.

    Attributes
    ----------
    height : ratio of body heights.
    groups : (M,) muscle of each fascicle. movers : (M, P) muscle whose regressions move each point.
    """

    def __init__(
        self, trunk: Trunk, subject: Subject, reference: Subject, regressions: Regressions
    ) -> None:
        self._trunk, self._regressions = trunk, regressions
        self._subject, self._reference = subject, reference
        self._of_row: dict[int, float] = {}
        self.height = subject.height_m / reference.height_m
        self.groups = np.array(trunk.muscles.groups, dtype=str)
        movers = self.groups.astype(object)[:, None].repeat(trunk.muscles.body.shape[1], axis=1)
        movers[trunk.muscles.in_sheath, 1] = RECTUS
        self.movers = movers.astype(str)

    def of_row(self, row: Regression) -> float:
        """Ratio by a row of regressions."""
        found = self._of_row.get(id(row))  # a row's own hash is of all its text
        if found is None:
            found = self._of_row[id(row)] = row.ratio(self._subject, self._reference)
        return found

    def place(self, points: Array, muscles: NDArray[np.str_]) -> Array:
        """Points (..., 3) m of muscles (...), at the person's size."""
        line = line_of_vertebrae(self._trunk, points[..., _Y])
        level = nearest_vertebra(self._trunk, points[..., _Y])
        stretch = np.stack(
            [
                self._of_places("ap_distance", muscles, level),
                np.full(level.shape, self.height),
                self._of_places("ml_distance", muscles, level),
            ],
            axis=-1,
        )
        # height moves all of it, the rest what lies off the line: nothing moves at ratios of 1
        found: Array = self.height * points + (stretch - self.height) * (points - line)
        return found

    def pcsa(self) -> Array:
        """(M,) ratios of cross-sections."""
        return self._of_places("pcsa", self.groups, self._fascicle_levels())

    def rows(self) -> Iterator[Regression]:
        """The rows of muscles that apply to this trunk, each once."""
        muscles = self._trunk.muscles
        real = muscles.body != NO_BODY
        points = self.movers[real]
        levels = nearest_vertebra(self._trunk, muscles.point[..., _Y][real])
        places: tuple[tuple[Quantity, NDArray[np.str_], NDArray[np.int64]], ...] = (
            ("ap_distance", points, levels),
            ("ml_distance", points, levels),
            ("pcsa", self.groups, self._fascicle_levels()),
        )
        for quantity, names, at in places:
            pairs = sorted(set(zip(names.tolist(), at.tolist(), strict=True)))
            yield from dict.fromkeys(
                self._regressions.row(quantity, m, REGRESSION_LEVELS[k]) for m, k in pairs
            )

    def _fascicle_levels(self) -> NDArray[np.int64]:
        """(M,) vertebra nearest to the middle of each fascicle's height."""
        muscles = self._trunk.muscles
        height, real = muscles.point[..., _Y], muscles.body != NO_BODY
        low = np.where(real, height, np.inf).min(axis=1)
        high = np.where(real, height, -np.inf).max(axis=1)
        return nearest_vertebra(self._trunk, 0.5 * (low + high))

    def _of_places(
        self, quantity: Quantity, muscles: NDArray[np.str_], level: NDArray[np.int64]
    ) -> Array:
        """Ratios of muscles (...) at vertebrae (...)."""
        pairs = list(zip(muscles.ravel().tolist(), level.ravel().tolist(), strict=True))
        at = {
            (m, k): self.of_row(self._regressions.row(quantity, m, REGRESSION_LEVELS[k]))
            for m, k in set(pairs)
        }
        return np.array([at[pair] for pair in pairs]).reshape(level.shape)
