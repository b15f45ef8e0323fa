"""Numbers of columns against their usual ranges, and what rigs prescribe and preload.

`columns.csv` says which number of which columns is held against which row of `ranges.csv`.
"""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.cohort.supports import PRESCRIBED
from spinepipe.plausibility.score import suspect, table, usual
from spinepipe.plausibility.warnings.warning import PACKAGE, PlausibilityWarning, TableCell, warn
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS

FORCES = ["fx_n", "fy_n", "fz_n"]

Warnings = Iterator[PlausibilityWarning]


def beyond_ranges(cohort: Cohort, *quantities: str) -> Warnings:
    """Numbers beyond their ranges, as `columns.csv` asks; zeros and empty cells are none.

    `each` row is held against the range, and the first beyond it is told; or the `largest` of all
    rows, where so many numbers are given as `at_least` says. Of several columns their norm is
    taken where that is said, else the largest.
    """
    for check in table(PACKAGE, "columns"):
        given = _table(cohort, check["table"])
        if check["quantity"] not in quantities or given is None:
            continue
        ending = check["columns"].removeprefix("*")
        names = check["columns"].split()
        if ending != check["columns"]:
            names = [str(name) for name in given if str(name).endswith(ending)]
        if not set(names) <= set(given.columns):
            continue
        sizes = given[names].abs().fillna(0.0)
        norm = check["of_several"] == "norm"
        size = (sizes**2).sum(axis=1) ** 0.5 if norm else sizes.max(axis=1)
        size = size[size > 0.0]
        if check["number"] == "largest":
            enough = int((sizes > 0.0).to_numpy().sum()) >= int(check["at_least"])
            size = size.nlargest(int(enough))
        limits = usual(check["quantity"])
        odd = size[~size.between(limits.low, limits.high)]
        if len(odd):
            yield _beyond(cohort, check, odd, sizes)


def _beyond(
    cohort: Cohort, check: Mapping[str, str], odd: pd.Series, sizes: pd.DataFrame
) -> PlausibilityWarning:
    value, row, quantity = float(odd.iloc[0]), odd.index[0], check["quantity"]
    unit = suspect(quantity, value, quantity)
    names = ", ".join(map(str, sizes))
    return warn(
        cohort,
        quantity,
        TableCell(check["table"], row, str(sizes.loc[row].idxmax())),
        remedy=unit and unit.mend(mended=f"{value * unit.factor:.3g}", columns=names),
        factor=unit and unit.factor,
        certain=quantity.endswith("_sd") and not usual("any_sd").holds(value),
        value=value,
        more=f" and {len(odd) - 1} more" if len(odd) > 1 else "",
    )


def _table(cohort: Cohort, stem: str) -> pd.DataFrame | None:
    own = cohort.further.get(stem)
    return getattr(cohort, stem, None) if own is None else own


def declared_errors(cohort: Cohort) -> Warnings:
    """SDs of one reading that no instrument has."""
    told = {} if cohort.measurement_sd is None else cohort.measurement_sd.model_dump()
    for name, sd in told.items():
        if sd is not None and not usual(f"{name}_sd").holds(sd):
            place = TableCell(COHORT_YAML, None, f"measurement_sd.{name}")
            sure = not usual("any_sd").holds(sd)
            yield warn(
                cohort, "reading_sd", place, certain=sure, value=sd, range=usual(f"{name}_sd")
            )


# --- rigs -----------------------------------------------------------------------------------------


def rigs(cohort: Cohort) -> Warnings:
    """Preloads, followers, and coordinates that supports.csv prescribes."""
    yield from beyond_ranges(cohort, "preload_force", "preload_moment", "follower")
    if cohort.preload is not None:
        forces = cohort.preload[FORCES].to_numpy(float)
        size = np.linalg.norm(forces, axis=1)
        up = forces[:, 1] > 0.7 * size
        if up.any() and up.sum() == (size > 0.0).sum():
            row = int(np.argmax(up))
            yield warn(
                cohort, "preload_pulls", TableCell("preload", row, FORCES[1]), value=forces[row, 1]
            )
    if cohort.supports is not None and cohort.motion is not None:
        yield from _prescribed(cohort, cohort.supports, cohort.motion)


def _prescribed(cohort: Cohort, supports: pd.DataFrame, motion: pd.DataFrame) -> Warnings:
    """Coordinates that a rig moves hardly at all."""
    given = supports[(supports["state"] == PRESCRIBED) & supports["coordinate"].isin(COORDINATES)]
    told = set()
    for test, coordinate in zip(given["test"], given["coordinate"], strict=True):
        column = COORDINATE_COLUMNS[COORDINATES.index(coordinate)]
        sizes = motion.loc[(motion["test"] == test) | (test == "*"), column].abs()
        kind = "rotation" if coordinate in ROTATIONS else "translation"
        size = sizes.max() if len(sizes) else 0.0
        if size > 0.0 and not usual(f"prescribed_{kind}").holds(size) and coordinate not in told:
            told.add(coordinate)
            place = TableCell("motion", sizes.idxmax(), column)
            yield warn(cohort, f"prescribed_{kind}", place, value=size, test=test)
