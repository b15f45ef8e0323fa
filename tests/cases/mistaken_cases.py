"""Ways to spoil a good cohort that leave every cell sound, each with the place to be told."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

XYZ = ("x_mm", "y_mm", "z_mm")
COM = ("com_x_mm", "com_y_mm", "com_z_mm")
POINT = ("px_mm", "py_mm", "pz_mm")
ANGLES = ("extension_deg", "right_bending_deg", "left_rotation_deg")
SHIFTS = ("anterior_mm", "superior_mm", "right_mm")
MOMENTS = ("mx_nm", "my_nm", "mz_nm")
FORCES = ("fx_n", "fy_n", "fz_n")

Table = Callable[[pd.DataFrame], None]


@dataclass(frozen=True)
class Mistake:
    """One way to spoil a cohort.

    Attributes
    ----------
    spoil : changes a table in place. needs : columns without which it changes nothing.
    told_in : files in which it may be told, one of them at least.
    """

    name: str
    file: str
    spoil: Table
    needs: tuple[str, ...]
    told_in: tuple[str, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Files, by name, one of which must be named."""
        return self.told_in or (self.file,)

    def apply(self, folder: Path) -> bool:
        """Spoil a cohort; False, and nothing done, where it makes no difference to it."""
        if self.file == "cohort.yaml" or not (folder / self.file).is_file():
            return False
        table = pd.read_csv(folder / self.file)
        if not set(self.needs) <= set(table.columns):
            return False
        numbers = table.select_dtypes("number").columns
        table = table.astype(dict.fromkeys(numbers.difference(["step", "cycle"]), float))
        before = table.copy()
        self.spoil(table)
        forced = _forced(before) | (self.needs != POINT)
        if table[forced].equals(before[forced]):
            return False
        table.to_csv(folder / self.file, index=False)
        return True


def _times(columns: Sequence[str], factor: float) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        there = [name for name in columns if name in table]
        table[there] *= factor

    return spoil


def _swap(first: str, second: str) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[[first, second]] = table[[second, first]].to_numpy()

    return spoil


def _exchange(first: int, second: int, by: str) -> Table:
    """Exchange what two things, by their place among the names of a column, are called."""

    def spoil(table: pd.DataFrame) -> None:
        names = list(dict.fromkeys(table[by]))
        if len(names) > max(first, second):
            a, b = names[first], names[second]
            table[by] = table[by].replace({a: b, b: a})

    return spoil


def _backwards(table: pd.DataFrame) -> None:
    """Joints named from the other end."""
    for _, rows in table.groupby("specimen"):
        table.loc[rows.index, "joint"] = rows["joint"].to_numpy()[::-1]


def _move(columns: Sequence[str], axis: int, by: float, row: int) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        acting = np.flatnonzero(_forced(table) & table[columns[axis]].notna())
        if len(acting):
            at = table.index[acting[min(row, len(acting) - 1)]]
            table.loc[at, columns[axis]] += by

    return spoil


def _forced(table: pd.DataFrame) -> pd.Series:
    if "fx_n" not in table:
        return pd.Series(True, index=table.index)
    return (table[list(FORCES)] != 0.0).any(axis=1)


def _collinear(table: pd.DataFrame) -> None:
    """The pedicle bases of one vertebra are drawn to the line through its endplates."""
    first = table.iloc[0]["specimen"]
    own = table[table["specimen"] == first]
    for _, rows in own.groupby("vertebra", sort=False):
        by = rows.set_index("landmark")[list(XYZ)]
        if {"left_pedicle_base", "inferior_endplate_centre", "superior_endplate_centre"} <= set(
            by.index
        ):
            low, high = by.loc["inferior_endplate_centre"], by.loc["superior_endplate_centre"]
            for side, share in (("left", 0.2), ("right", 0.8)):
                at = rows.index[rows["landmark"] == f"{side}_pedicle_base"]
                table.loc[at, list(XYZ)] = (low + share * (high - low) + [0, 0, 0.5]).to_numpy()
            return


def _set(columns: Sequence[str], value: float) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        there = [name for name in columns if name in table]
        table[there] = table[there].where(table[there].isna(), value)

    return spoil


def _one(column: str, value: float) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        read = table.index[table[column].notna() & (table["step"] > 0)]
        if len(read):
            table.loc[read[len(read) // 2], column] = value

    return spoil


def _steps_reversed(table: pd.DataFrame) -> None:
    """The readings of each series in the reverse order of its steps."""
    cells = [name for name in (*ANGLES, *SHIFTS) if name in table]
    keys = [name for name in ("specimen", "test", "cycle", "joint") if name in table]
    for _, rows in table.groupby(keys, dropna=False):
        order = rows.sort_values("step").index
        table.loc[order, cells] = table.loc[order[::-1], cells].to_numpy()


def _copy(column: str, onto: str) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[onto] = table[column]

    return spoil


_FACTORS = {"cm": 0.1, "inch": 1.0 / 25.4, "m": 1e-3, "x10": 10.0}
_PLACES = {
    "landmarks": ("landmarks.csv", XYZ),
    "joints": ("joints.csv", XYZ),
    "com": ("bodies.csv", COM),
    "points": ("loads.csv", POINT),
}


def _of_geometry() -> Iterator[Mistake]:
    for name, (file, columns) in _PLACES.items():
        for unit, factor in _FACTORS.items():
            yield Mistake(f"{name}_{unit}", file, _times(columns, factor), columns)
        yield Mistake(f"{name}_xy", file, _swap(*columns[:2]), columns)
        if name in ("landmarks", "joints"):
            yield Mistake(f"{name}_xz", file, _swap(columns[0], columns[2]), columns)
            yield Mistake(f"{name}_upside_down", file, _times(columns[1:2], -1.0), columns)
    yield Mistake("joints_radians", "joints.csv", _times(ANGLES, np.pi / 180.0), ANGLES)
    yield Mistake("joints_exchanged", "joints.csv", _exchange(0, 1, "joint"), XYZ)
    yield Mistake("joints_backwards", "joints.csv", _backwards, XYZ)
    yield Mistake("vertebrae_exchanged", "landmarks.csv", _exchange(0, 1, "vertebra"), XYZ)
    yield Mistake("collinear", "landmarks.csv", _collinear, XYZ)
    yield Mistake("mass_t", "bodies.csv", _times(("mass_kg",), 1e-3), COM)
    yield Mistake("mass_g", "bodies.csv", _times(("mass_kg",), 1e3), COM)
    yield Mistake("mass_com_x", "bodies.csv", _swap("mass_kg", "com_x_mm"), COM)
    for far in (200.0, 9000.0):
        for axis in range(3):
            spoil = _move(COM, axis, far, 1)
            yield Mistake(f"com_{far:g}_{'xyz'[axis]}", "bodies.csv", spoil, COM)
    for far in (500.0, 9000.0):
        for axis in range(3):
            spoil = _move(POINT, axis, far, 0)
            yield Mistake(f"point_{far:g}_{'xyz'[axis]}", "loads.csv", spoil, POINT)


def _of_motion() -> Iterator[Mistake]:
    both = ("motion.csv", "loads.csv")
    yield Mistake("no_loads", "loads.csv", _set((*MOMENTS, *FORCES), 0.0), MOMENTS)
    yield Mistake("n_mm", "loads.csv", _times(MOMENTS, 1e3), MOMENTS, both)
    yield Mistake("kn", "loads.csv", _times(FORCES, 1e-3), FORCES, both)
    yield Mistake("loads_turned", "loads.csv", _times((*MOMENTS, *FORCES), -1.0), MOMENTS, both)
    yield Mistake("radians", "motion.csv", _times(ANGLES, np.pi / 180.0), ANGLES[:1], both)
    yield Mistake("shifts_m", "motion.csv", _times(SHIFTS, 1e-3), SHIFTS[:1], both)
    yield Mistake("turned", "motion.csv", _times(ANGLES, -1.0), ANGLES[:1], both)
    yield Mistake("all_equal", "motion.csv", _set((*ANGLES, *SHIFTS), 1.5), ANGLES[:1])
    yield Mistake("all_zero", "motion.csv", _set((*ANGLES, *SHIFTS), 0.0), ANGLES[:1])
    yield Mistake("one_89", "motion.csv", _one("extension_deg", 89.0), ANGLES[:1])
    yield Mistake("steps_reversed", "motion.csv", _steps_reversed, ANGLES[:1])
    yield Mistake("constant", "motion.csv", _set(ANGLES[:1], -2.0), ANGLES[:1])
    yield Mistake("repeated", "motion.csv", _copy(*ANGLES[:2]), ANGLES[:2])
    yield Mistake("repeated_xy", "joints.csv", _copy(*XYZ[:2]), XYZ)


MISTAKES = (*_of_geometry(), *_of_motion())
