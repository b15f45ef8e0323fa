"""Masses in another unit, and masses that do not fit their inertia."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from math import log
from typing import Any

import numpy as np

from spinepipe.anatomy.levels import HEAVIEST_KG, SLICE_PERCENT, least_kg
from spinepipe.cohort.answers import of_specimens, typical
from spinepipe.cohort.check_geometry import INERTIA
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.cohort.neutral_pose import NeutralPose
from spinepipe.problems import Problem

MOST_KG = 2.0 * HEAVIEST_KG * SLICE_PERCENT[1] / 100.0
"""A specimen's bodies, in the median: the largest slice of the heaviest, and arms as heavy."""

ONE_KG = 60.0
"""A single body, chosen: the upper body of a heavy person."""

GYRATION_MM = (3.0, 250.0)
"""Radius of gyration, chosen about what the shipped cohorts hold: 13 mm of a vertebra with what is
next to it, 110 mm of a slice of a trunk."""

INERTIA_UNITS = {1e-6: "kg mm2", 1e-4: "kg cm2"}
"""What an inertia must be multiplied by to be kg m2, and what it is in."""

LIKELY_MM = (8.0, 150.0)
"""Of gyration once a unit is undone."""

UNITS = {1e3: "t", 1e-3: "g"}
"""What a mass must be multiplied by to be kg, and what it is in."""

USUAL_KG = 0.3
"""Between a vertebra (0.06 kg with what is next to it) and a slice of a trunk (1.1 to 2.6 % of body
mass, see `SLICE_PERCENT`)."""


def doubtful_masses(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[Doubt]:
    """Doubts about the masses of moving vertebrae."""
    if cohort.bodies is None:
        return
    table = cohort.bodies
    table = table[table["vertebra"] != cohort.vertebrae[0]]
    found: dict[str, list[str]] = defaultdict(list)
    exchanged = {doubt: specimen for specimen, doubt in _exchanged(cohort, poses)}
    yield from exchanged
    for specimen, own in table.groupby("specimen", sort=False):
        if specimen in exchanged.values():
            continue
        size = typical(own["mass_kg"].tolist())
        if not _least(own) <= size <= MOST_KG:
            factor = min(UNITS, key=lambda one: abs(log(size * one / USUAL_KG)))
            found[UNITS[factor]].append(str(specimen))
            continue
        yield from _single(cohort, own)
        yield from _gyration(cohort, own)
    for unit, specimens in found.items():
        rows = np.flatnonzero(cohort.bodies["specimen"] == specimens[0])
        place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", int(rows[0])), "mass_kg")
        own = table[table["specimen"].isin(specimens)]
        size = typical(own["mass_kg"].tolist())
        shown = f"masses of {size:.3g} ({of_specimens(specimens, cohort.specimen_names)})"
        allowed = f"{_least(own):.2g} to {MOST_KG:.3g} kg in the median of a specimen"
        factor = next(factor for factor, name in UNITS.items() if name == unit)
        remedy = f"suspected: masses in {unit} and not kg; multiply mass_kg by {factor:g}"
        yield Doubt(Problem(*place, shown, allowed, remedy), "masses", certain=True)


def _least(own: Any) -> float:
    """Half of a mean dry vertebra of these levels, kg."""
    return typical([least_kg(name) for name in own["vertebra"]])


def _single(cohort: Cohort, own: Any) -> Iterator[Doubt]:
    for row, vertebra, mass in zip(own.index, own["vertebra"], own["mass_kg"], strict=True):
        least = least_kg(vertebra) / 2.0
        if not least <= mass <= ONE_KG:
            place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", int(row)), "mass_kg")
            allowed = f"{least:.2g} to {ONE_KG:g} kg at this level"
            remedy = "suspected: g or t and not kg; correct it"
            yield Doubt(Problem(*place, f"{mass:.3g} ({vertebra})", allowed, remedy), "masses")


def _gyration(cohort: Cohort, own: Any) -> Iterator[Doubt]:
    """Bodies whose inertia has another unit, told once for each specimen."""
    moments = own[list(INERTIA[:3])].sum(axis=1, skipna=False) / 2.0
    radius = 1e3 * np.sqrt(moments / own["mass_kg"])
    odd = radius.notna() & (moments > 0.0)
    odd &= ~radius.between(*GYRATION_MM)
    if odd.any():
        row = int(radius.index[odd][0])
        place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", row), INERTIA[0])
        found = f"a radius of gyration of {radius[row]:.3g} mm ({own['specimen'].iloc[0]})"
        allowed = f"{GYRATION_MM[0]:g} to {GYRATION_MM[1]:g} mm"
        remedy = "look at the units of inertia (kg m2) and mass_kg, and for exchanged columns"
        for factor, unit in INERTIA_UNITS.items():
            if LIKELY_MM[0] <= radius[row] * factor**0.5 <= LIKELY_MM[1]:
                remedy = f"suspected: inertia in {unit} and not kg m2; multiply by {factor:g}"
        yield Doubt(Problem(*place, found, allowed, remedy), "masses")


def _exchanged(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[tuple[str, Doubt]]:
    """Masses that are where the centres of mass should be, and the reverse."""
    table = cohort.bodies
    assert table is not None
    for pose in poses:
        own = table[(table["specimen"] == pose.specimen)]
        if len(own) < 2:
            continue
        near = np.array([pose.near(name)[0] for name in own["vertebra"]])
        mass, anterior = own["mass_kg"].to_numpy(), own["com_x_mm"].to_numpy()
        apart = float(np.linalg.norm(mass - near)), float(np.linalg.norm(anterior - near))
        if apart[0] * 2.0 < apart[1] and np.all(anterior > 0.0) and np.all(anterior < 1.0):
            row = int(own.index[0])
            place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", row), "mass_kg")
            found = f"masses of {mass.min():.3g} to {mass.max():.3g} ({pose.specimen})"
            allowed = "kg, and com_x_mm in mm"
            remedy = "suspected: mass_kg and com_x_mm exchanged; exchange them back"
            yield pose.specimen, Doubt(Problem(*place, found, allowed, remedy), "masses")
