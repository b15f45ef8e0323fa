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
    columns : what is wrong, one of which must be named. remedy : pattern of the words that tell how
        to mend it.
    """

    name: str
    file: str
    spoil: Table
    needs: tuple[str, ...]
    told_in: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    remedy: str = ""

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
_WORDS = {"cm": r"in cm", "inch": r"inches", "m": r"in m\b", "x10": r"multiplied by 10\b"}
_PLACES = {
    "landmarks": ("landmarks.csv", XYZ),
    "joints": ("joints.csv", XYZ),
    "com": ("bodies.csv", COM),
    "points": ("loads.csv", POINT),
}


def _both(first: str, second: str) -> str:
    """A pattern of two names in any order and exchanged."""
    return rf"(?s)(?=.*{first})(?=.*{second}).*exchanged"


def _of_geometry() -> Iterator[Mistake]:
    for name, (file, columns) in _PLACES.items():
        for unit, factor in _FACTORS.items():
            spoil = _times(columns, factor)
            yield Mistake(f"{name}_{unit}", file, spoil, columns, (), columns, _WORDS[unit])
        for first, second in ((0, 1), (0, 2)) if name in ("landmarks", "joints") else ((0, 1),):
            pair = (columns[first], columns[second])
            axes = "xyz"[first] + "xyz"[second]
            yield Mistake(f"{name}_{axes}", file, _swap(*pair), columns, (), pair, _both(*pair))
        if name in ("landmarks", "joints"):
            spoil = _times(columns[1:2], -1.0)
            down = r"downwards|sign of y_mm"
            yield Mistake(f"{name}_upside_down", file, spoil, columns, (), ("y_mm",), down)
    spoil = _times(ANGLES, np.pi / 180.0)
    yield Mistake("joints_radians", "joints.csv", spoil, ANGLES, (), ANGLES, "radians")
    names = (("joint", *XYZ), r"exchanged|reverse")
    spoil = _exchange(0, 1, "joint")
    yield Mistake("joints_exchanged", "joints.csv", spoil, XYZ, (), *names)
    yield Mistake("joints_backwards", "joints.csv", _backwards, XYZ, (), *names)
    spoil, names = _exchange(0, 1, "vertebra"), (("vertebra", *XYZ), "exchanged")
    yield Mistake("vertebrae_exchanged", "landmarks.csv", spoil, XYZ, (), *names)
    yield Mistake("collinear", "landmarks.csv", _collinear, XYZ, (), XYZ, "misplaced")
    mass = ((), ("mass_kg",))
    yield Mistake("mass_t", "bodies.csv", _times(("mass_kg",), 1e-3), COM, *mass, r"in t\b")
    yield Mistake("mass_g", "bodies.csv", _times(("mass_kg",), 1e3), COM, *mass, r"in g\b")
    pair = ("mass_kg", "com_x_mm")
    yield Mistake("mass_com_x", "bodies.csv", _swap(*pair), COM, (), pair, _both(*pair))
    for columns, file, sizes in (
        (COM, "bodies.csv", (200.0, 9e3)),
        (POINT, "loads.csv", (5e2, 9e3)),
    ):
        for far in sizes:
            for axis in range(3):
                name = f"{'com' if columns is COM else 'point'}_{far:g}_{'xyz'[axis]}"
                spoil = _move(columns, axis, far, int(columns is COM))
                told = ((), columns[axis : axis + 1], "misplaced")
                yield Mistake(name, file, spoil, columns, *told)


def _of_motion() -> Iterator[Mistake]:
    both = ("motion.csv", "loads.csv")
    read = (*ANGLES, *SHIFTS)
    loads, motion = "loads.csv", "motion.csv"
    zero = _set((*MOMENTS, *FORCES), 0.0)
    yield Mistake("no_loads", loads, zero, MOMENTS, (), (*FORCES, *MOMENTS), "fill in the loads")
    yield Mistake("n_mm", loads, _times(MOMENTS, 1e3), MOMENTS, both, MOMENTS, "N mm")
    yield Mistake("kn", loads, _times(FORCES, 1e-3), FORCES, both, (*FORCES, *SHIFTS), "kN")
    turned = (*MOMENTS, *FORCES)
    sign = ((*turned, *read), r"sign of")
    yield Mistake("loads_turned", loads, _times(turned, -1.0), MOMENTS, both, *sign)
    spoil = _times(ANGLES, np.pi / 180.0)
    yield Mistake("radians", motion, spoil, ANGLES[:1], both, ANGLES, "radians")
    yield Mistake("shifts_m", motion, _times(SHIFTS, 1e-3), SHIFTS[:1], both, SHIFTS, r"in m\b")
    yield Mistake("turned", motion, _times(ANGLES, -1.0), ANGLES[:1], both, ANGLES, "sign of")
    copied = "filled down|copied"
    yield Mistake("all_equal", motion, _set(read, 1.5), ANGLES[:1], (), read, copied)
    yield Mistake("all_zero", motion, _set(read, 0.0), ANGLES[:1], (), read, "leave cells empty")
    spoil = _one("extension_deg", 89.0)
    yield Mistake("one_89", motion, spoil, ANGLES[:1], (), ANGLES[:1], "slip|decimal")
    steps = (("step", *read), "reverse")
    yield Mistake("steps_reversed", motion, _steps_reversed, ANGLES[:1], (), *steps)
    yield Mistake("constant", motion, _set(ANGLES[:1], -2.0), ANGLES[:1], (), ANGLES[:1], copied)
    spoil = _copy(*ANGLES[:2])
    yield Mistake("repeated", motion, spoil, ANGLES[:2], (), ANGLES[:2], copied)
    yield Mistake("repeated_xy", "joints.csv", _copy(*XYZ[:2]), XYZ, (), XYZ[:2], copied)


MISTAKES = (*_of_geometry(), *_of_motion())
