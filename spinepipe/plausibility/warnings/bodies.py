"""Masses and inertia in another unit, and persons whose height, mass and age are no person's."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from spinepipe.cohort.check_geometry import INERTIA
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_response import typical
from spinepipe.plausibility.score import BETTER, MistakeHypothesis, suspect, usual
from spinepipe.plausibility.warnings.levels import NeutralPose, least_kg
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, first_row, warn


def masses(cohort: Cohort, poses: Sequence[NeutralPose]) -> Iterator[PlausibilityWarning]:
    """Masses and inertia of moving vertebrae."""
    if cohort.bodies is None:
        return
    table = cohort.bodies[cohort.bodies["vertebra"] != cohort.vertebrae[0]]
    exchanged = {pose.specimen: one for pose in poses for one in _exchanged(cohort, pose)}
    yield from exchanged.values()
    in_unit: dict[MistakeHypothesis | None, list[str]] = defaultdict(list)
    for specimen, own in table.groupby("specimen", sort=False):
        if specimen in exchanged:
            continue
        size = typical(own["mass_kg"].tolist())
        if _least(own) <= size <= usual("body_mass").high:
            yield from _single(cohort, own)
            yield from _gyration(cohort, own)
        else:
            in_unit[suspect("body_mass", size, "body_mass")].append(str(specimen))
    for unit, names in in_unit.items():
        own = table[table["specimen"].isin(names)]
        place = TableCell("bodies", first_row(cohort, "bodies", specimen=names[0]), "mass_kg")
        remedy = unit.mend() if unit else None
        yield warn(
            cohort,
            "body_mass",
            place,
            remedy=remedy,
            size=typical(own["mass_kg"].tolist()),
            least=_least(own),
            whose=names,
        )


def _least(own: pd.DataFrame) -> float:
    """Half of a mean dry vertebra of these levels, kg."""
    return typical([least_kg(name) for name in own["vertebra"]])


def _single(cohort: Cohort, own: pd.DataFrame) -> Iterator[PlausibilityWarning]:
    for row, vertebra, mass in zip(own.index, own["vertebra"], own["mass_kg"], strict=True):
        least = least_kg(vertebra) / 2.0
        if not least <= mass <= usual("one_body_mass").high:
            yield warn(
                cohort,
                "one_body_mass",
                TableCell("bodies", row, "mass_kg"),
                mass=mass,
                vertebra=vertebra,
                least=least,
            )


def _gyration(cohort: Cohort, own: pd.DataFrame) -> Iterator[PlausibilityWarning]:
    """Bodies whose inertia has another unit, told once for each specimen."""
    moments = own[list(INERTIA[:3])].sum(axis=1, skipna=False) / 2.0
    radius = 1e3 * (moments / own["mass_kg"]) ** 0.5
    limits = usual("gyration")
    odd = radius.notna() & (moments > 0.0) & ~radius.between(limits.low, limits.high)
    if odd.any():
        row = radius.index[odd][0]
        unit = suspect("gyration", radius[row], "gyration")
        # Inertia goes with the square of the radius.
        remedy = unit.mend(squared=f"{unit.factor**2:g}") if unit else None
        yield warn(
            cohort,
            "gyration",
            TableCell("bodies", row, INERTIA[0]),
            remedy=remedy,
            radius=radius[row],
            whose=[own["specimen"].iloc[0]],
        )


def _exchanged(cohort: Cohort, pose: NeutralPose) -> Iterator[PlausibilityWarning]:
    """Masses that are where the centres of mass should be, and the reverse."""
    table = cohort.bodies
    assert table is not None
    own = table[table["specimen"] == pose.specimen]
    if len(own) < 2:
        return
    near = np.array([pose.near(name)[0] for name in own["vertebra"]])
    mass, anterior = own["mass_kg"].to_numpy(), own["com_x_mm"].to_numpy()
    apart = float(np.linalg.norm(mass - near)), float(np.linalg.norm(anterior - near))
    if apart[0] * BETTER < apart[1] and np.all((anterior > 0.0) & (anterior < 1.0)):
        yield warn(
            cohort,
            "mass_exchanged",
            TableCell("bodies", own.index[0], "mass_kg"),
            low=mass.min(),
            high=mass.max(),
            whose=[pose.specimen],
        )


# --- persons --------------------------------------------------------------------------------------


def persons_of_specimens(cohort: Cohort) -> Iterator[PlausibilityWarning]:
    """Persons of ``specimens.csv``."""
    columns = ("height_m", "mass_kg", "age_years")
    if set(columns[:2]) <= set(cohort.specimens.columns):
        numbers = cohort.specimens.reindex(columns=columns).apply(pd.to_numeric, errors="coerce")
        for row, (who, size) in enumerate(
            zip(cohort.specimens["specimen"], numbers.to_numpy(float), strict=True)
        ):
            yield from person(cohort, TableCell("specimens", row, columns[0]), who, 1.0, *size)


def person(
    cohort: Cohort,
    place: TableCell,
    who: str,
    per_m: float,
    height_m: float,
    mass_kg: float,
    age_years: float,
) -> Iterator[PlausibilityWarning]:
    """Warnings of one person; numbers that are not given are NaN.

    Parameters
    ----------
    place : of its height. per_m : how many of the units of that column are a metre.
    """
    if age_years >= usual("age").high:
        yield warn(
            cohort,
            "age",
            place._replace(column="age_years"),
            age=age_years,
            years=age_years / 12.0,
            who=who,
        )
    limits = usual("height")
    if height_m > 0.0 and not limits.holds(height_m):
        unit = suspect("height", height_m * per_m, "height")
        remedy = unit and unit.mend(mended=f"{height_m * per_m**2 * unit.factor:.4g}")
        yield warn(
            cohort,
            "height",
            place,
            remedy=remedy,
            who=who,
            size=height_m * per_m,
            low=limits.low * per_m,
            high=limits.high * per_m,
        )
    elif height_m > 0.0 and mass_kg > 0.0:
        bmi = mass_kg / height_m**2
        if not usual("body_mass_index").holds(bmi):
            unit = suspect("body_mass_index", bmi, "body_mass_index")
            remedy = unit and unit.mend(mended=f"{mass_kg * unit.factor:.1f}")
            at = place._replace(column="mass_kg")
            yield warn(cohort, "body_mass_index", at, remedy=remedy, bmi=bmi, mass=mass_kg, who=who)
