"""Masses in another unit, and masses that do not fit their inertia."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from math import log
from typing import Any

import numpy as np

from spinepipe.cohort.answers import of_specimens, typical
from spinepipe.cohort.check_geometry import INERTIA
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_line
from spinepipe.cohort.neutral_pose import NeutralPose
from spinepipe.problems import Problem

MASS_KG = (0.008, 15.0)
"""A specimen's bodies, in the median: from a bare cervical vertebra (0.01 kg) to a slice of a large
trunk (2.6 kg, Pearsall et al. 1996) with arms, five times."""

ONE_KG = (0.002, 60.0)
"""A single body: the upper body of a heavy person."""

GYRATION_MM = (3.0, 250.0)
"""Radius of gyration: 9 mm of a bare vertebra, 100 mm of a slice of a trunk."""

UNITS = {1e3: "t", 1e-3: "g"}
"""What a mass must be multiplied by to be kg, and what it is in."""

USUAL_KG = 0.3
"""Between a bare vertebra (0.06 kg) and a slice of a trunk (1.6 kg)."""


def doubtful_masses(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[Doubt]:
    """Doubts about the masses of moving vertebrae."""
    if cohort.bodies is None:
        return
    table = cohort.bodies
    table = table[table["vertebra"] != cohort.vertebrae[0]]
    found: dict[str, list[str]] = defaultdict(list)
    for specimen, own in table.groupby("specimen", sort=False):
        size = typical(own["mass_kg"].tolist())
        if not MASS_KG[0] <= size <= MASS_KG[1]:
            factor = min(UNITS, key=lambda one: abs(log(size * one / USUAL_KG)))
            found[UNITS[factor]].append(str(specimen))
        else:
            yield from _single(cohort, own)
        yield from _gyration(cohort, own)
    for unit, specimens in found.items():
        rows = np.flatnonzero(cohort.bodies["specimen"] == specimens[0])
        place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", int(rows[0])), "mass_kg")
        size = typical(table[table["specimen"].isin(specimens)]["mass_kg"].tolist())
        shown = f"masses of {size:.3g} ({of_specimens(specimens, cohort.specimen_names)})"
        allowed = f"{MASS_KG[0]:g} to {MASS_KG[1]:g} kg in the median of a specimen"
        remedy = f"suspected: masses in {unit} and not kg, or columns exchanged; convert the column"
        yield Doubt(Problem(*place, shown, allowed, remedy), "masses", certain=True)
    yield from _exchanged(cohort, poses)


def _single(cohort: Cohort, own: Any) -> Iterator[Doubt]:
    for row, vertebra, mass in zip(own.index, own["vertebra"], own["mass_kg"], strict=True):
        if not ONE_KG[0] <= mass <= ONE_KG[1]:
            place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", int(row)), "mass_kg")
            allowed = f"{ONE_KG[0]:g} to {ONE_KG[1]:g} kg"
            remedy = "suspected: g or t and not kg; correct it"
            yield Doubt(Problem(*place, f"{mass:.3g} ({vertebra})", allowed, remedy), "masses")


def _gyration(cohort: Cohort, own: Any) -> Iterator[Doubt]:
    """Bodies whose mass or inertia has another unit, told once for each specimen."""
    moments = own[list(INERTIA[:3])].sum(axis=1, skipna=False) / 2.0
    radius = 1e3 * np.sqrt(moments / own["mass_kg"])
    odd = radius.notna() & (moments > 0.0)
    odd &= ~radius.between(*GYRATION_MM)
    if odd.any():
        row = int(radius.index[odd][0])
        place = (file_of(cohort, "bodies"), first_line(cohort, "bodies", row), "mass_kg")
        found = f"a radius of gyration of {radius[row]:.3g} mm ({own['specimen'].iloc[0]})"
        allowed = f"{GYRATION_MM[0]:g} to {GYRATION_MM[1]:g} mm"
        remedy = "look at the units of mass (kg) and inertia (kg m2), and for exchanged columns"
        yield Doubt(Problem(*place, found, allowed, remedy), "masses")


def _exchanged(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[Doubt]:
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
            yield Doubt(Problem(*place, found, allowed, remedy), "masses")
