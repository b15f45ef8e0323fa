"""Nuisances: small imperfections that every cohort has, and that must not pose as physics.

Each is an effect of the library whose strengths have a prior around off. They enter linearised at
the fitted base: a nuisance adds ``J S J'`` to the covariance of the readings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.search.hypothesis import Variant
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen, bushing_stiffness
from spinepipe.studies.discrepancy.search.projected import (
    EVERY_TEST,
    VariantColumn,
    signatures_of_each,
)
from spinepipe.units import COORDINATES, ROTATIONS


@dataclass(frozen=True)
class NuisancePriors:
    """One prior SD of each imperfection, SI; zero leaves it out.

    ``posture`` tilts laws and reported frames of a joint together, as a neutral pose that was told
    wrongly does; ``law_axes`` and ``registration`` tilt them apart. ``load_axis`` turns moments,
    and forces apart from them. ``off_diagonal`` : share of the (geometric) mean of the two
    stiffnesses that it couples.
    """

    joint_centre: float = 2e-3
    posture: float = float(np.deg2rad(2.0))
    law_axes: float = float(np.deg2rad(1.0))
    registration: float = float(np.deg2rad(1.0))
    load_axis: float = float(np.deg2rad(1.0))
    load_gain: float = 0.02
    off_diagonal: float = 0.02
    rotation_order: float = 0.5


POSTURE = (Variant("axes_tilt", ()), Variant("marker_bias", (("form", "tilt"),)))
"""What a wrongly told neutral pose tilts by the same angles."""


TURNED_MOMENTS = Variant("load_misalignment", (("turns", "moments"),))
TURNED_FORCES = Variant("load_misalignment", (("turns", "forces"),))
"""Two, as a preload is seldom applied by what applies the moments."""


def nuisance_columns(
    priors: NuisancePriors,
    stiffness: Array,
    cases: Sequence[LoadCase],
    coordinates: Sequence[str] = ROTATIONS,
) -> list[VariantColumn]:
    """The nuisances of a specimen as columns, each scaled to its prior SD.

    Parameters
    ----------
    stiffness : (J, 6) of the base, SI. coordinates : those that are read.
    """
    every, each_test = (EVERY_TEST,), tuple(dict.fromkeys(case.test for case in cases))
    wrenches = [(case.test, w) for case in cases for step in case.steps for w in step.wrenches]
    pushed = tuple(dict.fromkeys(test for test, wrench in wrenches if wrench.force.any()))
    blocks = [
        (Variant("joint_centre_offset", ()), priors.joint_centre, every),
        (Variant("axes_tilt", ()), priors.law_axes, every),
        (Variant("marker_bias", (("form", "tilt"),)), priors.registration, every),
        (TURNED_MOMENTS, priors.load_axis, each_test),
        (TURNED_FORCES, priors.load_axis, pushed),
        (Variant("load_gain", ()), priors.load_gain, each_test),
        (Variant("rotation_order", ()), priors.rotation_order, every),
    ]
    found = [
        column
        for variant, sd, places in blocks
        for column in _columns(variant, np.full(len(stiffness), sd), places)
    ]
    for pair in combinations([name for name in COORDINATES if name in coordinates], 2):
        coupled = stiffness[:, [COORDINATES.index(name) for name in pair]]
        sds = priors.off_diagonal * np.sqrt(np.prod(coupled, axis=1))
        found += _columns(Variant("bending_rotation_coupling", (("pair", pair),)), sds, every)
    return found


def _columns(variant: Variant, sds: Array, places: Sequence[str]) -> list[VariantColumn]:
    """Columns of a nuisance with these prior SDs (J,), those of zero left out."""
    rows = list(range(len(sds))) if variant.create().per_joint else [None]
    shapes = (0.0,) * len(variant.shapes)
    return [
        VariantColumn(variant, shapes, strength, joint, test, float(sds[joint or 0]))
        for strength in variant.strengths
        for joint in rows
        for test in places
        if sds[joint or 0] > 0.0
    ]


COMMON_TO_JOINTS = ("rotation_order", "bending_rotation_coupling")
"""Nuisances that joints may share, as they come from one convention or one kind of tissue."""


def _shared(columns: Sequence[VariantColumn]) -> list[tuple[Variant, int]]:
    """Variant and strength of the nuisances that joints may share, in order of appearance."""
    names = [(c.variant, c.strength) for c in columns if c.variant.effect in COMMON_TO_JOINTS]
    return list(dict.fromkeys(names))


KINDS = {
    "joint_centre_offset": "joint_centre",
    "axes_tilt": "law_axes",
    "marker_bias": "registration",
    "load_misalignment": "load_axis",
    "bending_rotation_coupling": "off_diagonal",
}
"""What `NuisancePriors` and settings call an effect's nuisance; others have the effect's name."""

OFF_DIAGONAL, POSTURE_KIND = "off_diagonal", "posture"


@dataclass(frozen=True)
class Label:
    """What a column of `nuisance_signatures` is of.

    Attributes
    ----------
    kind : as a field of `NuisancePriors`. component : parameter, or the coordinates it couples.
    joint : index; None for all joints alike, or for a load. test : name, or ``*``.
    sd : one prior SD in ``unit``: m, rad, or 1 for a share.
    """

    kind: str
    component: str
    joint: int | None
    test: str
    sd: float
    unit: str


def nuisance_labels(
    priors: NuisancePriors,
    stiffness: Array,
    cases: Sequence[LoadCase],
    coordinates: Sequence[str] = ROTATIONS,
) -> tuple[Label, ...]:
    """What each column of `nuisance_signatures` is, in its order.

    Parameters
    ----------
    stiffness : (J, 6) of the base, SI. coordinates : those that are read.
    """
    columns = nuisance_columns(priors, stiffness, cases, coordinates)
    shared = [
        next(c for c in columns if (c.variant, c.strength) == one) for one in _shared(columns)
    ]
    posture = np.full(len(stiffness), priors.posture)
    tilts = _columns(POSTURE[0], posture, (EVERY_TEST,))
    return (
        *(_label(one, one.joint, priors) for one in columns),
        *(_label(one, None, priors) for one in shared),
        *(replace(_label(one, one.joint, priors), kind=POSTURE_KIND) for one in tilts),
    )


def _label(one: VariantColumn, joint: int | None, priors: NuisancePriors) -> Label:
    parameter = one.variant.create().parameters[one.strength]
    kind = KINDS.get(one.variant.effect, one.variant.effect)
    if one.variant == TURNED_FORCES:
        return Label(kind, f"{parameter.name} of forces", joint, one.test, one.scale, "rad")
    pair = dict(one.variant.options).get("pair")
    if kind == OFF_DIAGONAL:  # its SD is a share of what it couples
        component = " x ".join(pair) if pair else parameter.name
        return Label(kind, component, joint, one.test, priors.off_diagonal, "1")
    return Label(kind, parameter.name, joint, one.test, one.scale, parameter.unit)


def nuisance_signatures(
    solved: SolvedSpecimen, priors: NuisancePriors, coordinates: Sequence[str] = ROTATIONS
) -> tuple[Array, ...]:
    """(T, J, 6, k) change of each test's readings by one prior SD of each nuisance.

    Rotation order and off-diagonals differ between joints, and again all together by as much.

    Parameters
    ----------
    coordinates : those that are read.
    """
    stiffness = bushing_stiffness(solved.model)
    columns = nuisance_columns(priors, stiffness, solved.cases, coordinates)
    posture = np.full(len(stiffness), priors.posture)
    tilts = [_columns(variant, posture, (EVERY_TEST,)) for variant in POSTURE]
    single, *together = signatures_of_each(solved, [columns, *tilts])
    # columns of a nuisance that joints may share, all joints together: onto (k, g)
    names = [(c.variant, c.strength) for c in columns]
    kinds = _shared(columns)
    onto = np.array([[name == kind for kind in kinds] for name in names], dtype=float)
    onto = onto.reshape(len(columns), len(kinds))
    single = tuple(np.concatenate([one, one @ onto], axis=-1) for one in single)
    if not priors.posture:
        return single
    return tuple(
        np.concatenate([one, np.sum(tilts, axis=0)], axis=-1)
        for one, *tilts in zip(single, *together, strict=True)
    )


def as_si(settings: Mapping[str, float]) -> NuisancePriors:
    """Priors from a study's settings (mm, deg)."""
    return NuisancePriors(
        joint_centre=settings["joint_centre_mm"] / 1000.0,
        posture=float(np.deg2rad(settings["posture_deg"])),
        law_axes=float(np.deg2rad(settings["law_axes_deg"])),
        registration=float(np.deg2rad(settings["registration_deg"])),
        load_axis=float(np.deg2rad(settings["load_axis_deg"])),
        load_gain=settings["load_gain"],
        off_diagonal=settings["off_diagonal"],
        rotation_order=settings["rotation_order"],
    )
