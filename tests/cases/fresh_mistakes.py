"""Kinds of mistakes that were written down before the rules were looked at, to score them fairly.

None of them guided a rule when it was scored first; docs/decisions/0039 has both scores. Some
cannot be seen by anybody (kgf for N): they stay, and count as missed.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pandas as pd
from mistaken_cases import ANGLES, COM, FORCES, MOMENTS, POINT, SHIFTS, XYZ, Mistake, Table

BODIES, JOINTS, LANDMARKS = "bodies.csv", "joints.csv", "landmarks.csv"
LOADS, MOTION = "loads.csv", "motion.csv"
INERTIA = ("ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2")
BOTH = (MOTION, LOADS)
READ = (*ANGLES, *SHIFTS)


def _times(
    columns: Sequence[str], factor: float, where: Callable[..., pd.Series] | None = None
) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        there = [name for name in columns if name in table]
        rows = slice(None) if where is None else where(table)
        table.loc[rows, there] *= factor

    return spoil


def _swap(first: str, second: str) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[[first, second]] = table[[second, first]].to_numpy()

    return spoil


def _first_specimen(table: pd.DataFrame) -> pd.Series:
    return table["specimen"] == table["specimen"].iloc[0]


def _rolled(table: pd.DataFrame) -> None:
    """Centres of mass one row too low: each vertebra has its neighbour's."""
    for _, rows in table.groupby("specimen", sort=False):
        table.loc[rows.index, list(COM)] = np.roll(rows[list(COM)].to_numpy(), 1, axis=0)


def _local(table: pd.DataFrame) -> None:
    """Centres of mass from that of the lowest vertebra, not from the origin, in another place."""
    for _, rows in table.groupby("specimen", sort=False):
        points = rows[list(COM)].to_numpy()
        table.loc[rows.index, list(COM)] = np.diff(points, axis=0, prepend=points[:1])


def _stitched(by: str, first: int) -> Table:
    """The upper part of each spine was scanned in a second piece that lies 60 mm in front."""

    def spoil(table: pd.DataFrame) -> None:
        for _, rows in table.groupby("specimen", sort=False):
            upper = list(dict.fromkeys(rows[by]))[first:]
            table.loc[rows.index[rows[by].isin(upper)], "x_mm"] += 60.0

    return spoil


def _slip(columns: Sequence[str], row: int, factor: float = 10.0) -> Table:
    """One cell whose decimal point slipped: of those that are not small the one in the middle."""

    def spoil(table: pd.DataFrame) -> None:
        for column in columns:
            if column in table:
                large = table.index[table[column].abs() > 0.5 * table[column].abs().max()]
                if len(large):
                    table.loc[large[min(row, len(large) - 1)], column] *= factor
                return

    return spoil


def _late(table: pd.DataFrame) -> None:
    """Readings one step late: those of step n stand at step n + 1."""
    cells = [name for name in READ if name in table]
    for _, rows in _series(table):
        order = rows.sort_values("step").index
        values = table.loc[order, cells].to_numpy()
        table.loc[order, cells] = np.vstack([values[:1], values[:-1]])


def _series(table: pd.DataFrame) -> Iterator[tuple[object, pd.DataFrame]]:
    keys = [name for name in ("specimen", "test", "cycle", "joint") if name in table]
    yield from table.groupby(keys, dropna=False, sort=False)


def _unsigned(table: pd.DataFrame) -> None:
    there = [name for name in ANGLES if name in table]
    table[there] = table[there].abs()


def _silent_joint(table: pd.DataFrame) -> None:
    """One joint's readings that were never taken stand as zeros."""
    names = list(dict.fromkeys(table["joint"]))
    if len(names) > 1:
        cells = [name for name in READ if name in table]
        rows = table["joint"] == names[len(names) // 2]
        table.loc[rows, cells] = table.loc[rows, cells].where(table.loc[rows, cells].isna(), 0.0)


def _sentinel(table: pd.DataFrame) -> None:
    """Readings that are missing were written as -99."""
    for column in SHIFTS:
        if column in table and table[column].notna().any():
            rows = table.index[table[column].notna() & (table["step"] > 0)]
            table.loc[rows[::3], column] = -99.0
            return


def _renamed(column: str, pairs: dict[str, str]) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[column] = table[column].replace(pairs | {new: old for old, new in pairs.items()})

    return spoil


def _moved_down(table: pd.DataFrame) -> None:
    """Loads written beside the lowest moving vertebra and not the uppermost."""
    names = {"L1": "L3", "T12": "L5", "L2": "L3", "C3": "C6", "L4": "L4"}
    table["vertebra"] = table["vertebra"].replace(names)


def _copied_cycle(table: pd.DataFrame) -> None:
    """A second cycle that is a copy of the first."""
    if "cycle" not in table or table["cycle"].nunique() < 2:
        return
    cells = [name for name in READ if name in table]
    keys = [name for name in ("specimen", "test", "step", "joint") if name in table]
    for _, rows in table.groupby(keys, sort=False):
        later = rows.index[rows["cycle"] > rows["cycle"].min()]
        table.loc[later, cells] = rows.loc[rows["cycle"].idxmin(), cells].to_numpy()


def _copied_specimen(table: pd.DataFrame) -> None:
    """A second specimen's readings that are a copy of the first one's."""
    names = list(dict.fromkeys(table["specimen"]))
    cells = [name for name in READ if name in table]
    keys = [name for name in ("test", "cycle", "step", "joint") if name in table]
    if len(names) > 1:
        first = table[table["specimen"] == names[0]].set_index(keys)[cells]
        rows = table.index[table["specimen"] == names[1]]
        wanted = first.reindex(pd.MultiIndex.from_frame(table.loc[rows, keys]))
        table.loc[rows, cells] = wanted.to_numpy()


def _in_ground(table: pd.DataFrame) -> None:
    """Rotations of vertebrae in ground, and not against the one below."""
    cells = [name for name in ANGLES if name in table]
    keys = [name for name in ("specimen", "test", "cycle", "step") if name in table]
    if table["joint"].nunique() > 1:
        table[cells] = table.groupby(keys, dropna=False, sort=False)[cells].cumsum()


def _reversed_loads(table: pd.DataFrame) -> None:
    cells = [*FORCES, *MOMENTS]
    keys = [name for name in ("specimen", "test", "cycle", "vertebra") if name in table]
    for _, rows in table.groupby(keys, dropna=False, sort=False):
        order = rows.sort_values("step").index
        table.loc[order, cells] = table.loc[order[::-1], cells].to_numpy()


def _below_zero(columns: Sequence[str]) -> Table:
    """Load points counted from the uppermost joint: near nought."""

    def spoil(table: pd.DataFrame) -> None:
        points = table[list(columns)]
        table[list(columns)] = points - points.mean() + [0.0, 20.0, 0.0]

    return spoil


def _of_places() -> Iterator[Mistake]:
    yield Mistake("com_of_neighbour", BODIES, _rolled, COM, (), ("vertebra", *COM), "exchanged|row")
    yield Mistake("com_from_neighbour", BODIES, _local, COM, (), COM, "ground|misplaced|relative")
    spoil = _times(COM[1:2], -1.0)
    yield Mistake("com_upside_down", BODIES, spoil, COM, (), COM[1:2], "downwards|sign of com_y")
    yield Mistake("mass_lb", BODIES, _times(("mass_kg",), 2.2046), COM, (), ("mass_kg",), r"\blb\b")
    for name, factor, words in (("kg_mm2", 1e6, r"kg mm2"), ("kg_cm2", 1e4, r"kg cm2")):
        told = ((), INERTIA, words)
        yield Mistake(f"inertia_{name}", BODIES, _times(INERTIA, factor), INERTIA, *told)
    spoil = _times(ANGLES[:1], -1.0)
    yield Mistake("joints_extension_sign", JOINTS, spoil, ANGLES, (), ANGLES[:1], "sign of extens")
    yield Mistake("joints_z_left", JOINTS, _times(XYZ[2:], -1.0), XYZ, (), XYZ[2:], "sign of z")
    yield Mistake(
        "landmarks_z_left", LANDMARKS, _times(XYZ[2:], -1.0), XYZ, (), XYZ[2:], "sign|left"
    )
    spoil = _times(XYZ, 0.1, _first_specimen)
    yield Mistake("one_specimen_cm", LANDMARKS, spoil, XYZ, (), XYZ, r"in cm")
    yield Mistake("one_specimen_cm_joints", JOINTS, spoil, XYZ, (), XYZ, r"in cm")
    for stem, by in ((LANDMARKS, "vertebra"), (JOINTS, "joint")):
        yield Mistake(f"stitched_{by}", stem, _stitched(by, 2), XYZ, (), XYZ[:1], "misplaced|piece")
        yield Mistake(f"slip_{by}", stem, _slip(XYZ[1:2], 1), XYZ, (), XYZ[1:2], "misplaced|slip")
    sides = {"left_pedicle_base": "right_pedicle_base", "left_pedicle": "right_pedicle"}
    told = ((), ("landmark", "z_mm"), "left and right")
    yield Mistake("sides_exchanged", LANDMARKS, _renamed("landmark", sides), XYZ, *told)
    faces = {"superior_endplate_centre": "inferior_endplate_centre"}
    told = ((), ("landmark", "y_mm"), "superior and inferior|endplates")
    yield Mistake("faces_exchanged", LANDMARKS, _renamed("landmark", faces), XYZ, *told)
    yield Mistake(
        "landmark_sd_m", LANDMARKS, _times(("sd_mm",), 1e-3), ("sd_mm",), (), ("sd_mm",), "m"
    )


def _of_loads() -> Iterator[Mistake]:
    yield Mistake("kgf", LOADS, _times(FORCES, 1.0 / 9.81), FORCES, BOTH, (*FORCES, *READ), "kgf")
    yield Mistake(
        "mx_mz", LOADS, _swap(*MOMENTS[::2]), MOMENTS, BOTH, (*MOMENTS, *ANGLES), "exchang"
    )
    told = (("vertebra",), "vertebra")
    yield Mistake("load_on_lowest", LOADS, _moved_down, MOMENTS, BOTH, *told)
    yield Mistake(
        "loads_reversed", LOADS, _reversed_loads, MOMENTS, BOTH, ("step", *MOMENTS), "revers"
    )
    spoil = _below_zero(POINT)
    yield Mistake("points_from_joint", LOADS, spoil, POINT, (), POINT, "ground|misplaced")
    yield Mistake("time_ms", LOADS, _times(("time_s",), 1e3), ("time_s",), (), ("time_s",), "ms")
    spoil = _slip((*MOMENTS[::-1], *FORCES), 0)
    yield Mistake("one_load_slip", LOADS, spoil, MOMENTS, BOTH, (*MOMENTS, *FORCES), "slip|decimal")


def _of_readings() -> Iterator[Mistake]:
    pairs = ((0, 1), (1, 2))
    for first, second in pairs:
        pair = (ANGLES[first], ANGLES[second])
        yield Mistake(
            f"swapped_{first}{second}", MOTION, _swap(*pair), pair, BOTH, pair, "exchanged"
        )
    spoil, told = _times(ANGLES[:1], -1.0), (BOTH, ANGLES[:1], "sign of")
    yield Mistake("flexion_positive", MOTION, spoil, ANGLES[:1], *told)
    spoil = _times(ANGLES, np.pi / 180.0, _first_specimen)
    yield Mistake("one_specimen_radians", MOTION, spoil, ANGLES[:1], (), ANGLES, "radians")
    spoil = _slip(ANGLES, 2)
    yield Mistake("one_reading_slip", MOTION, spoil, ANGLES[:1], (), ANGLES, "slip|decimal")
    yield Mistake("one_step_late", MOTION, _late, ANGLES[:1], (), ("step", *READ), "step")
    yield Mistake("signs_lost", MOTION, _unsigned, ANGLES[:1], (), ANGLES, "sign")
    yield Mistake("silent_joint", MOTION, _silent_joint, ANGLES[:1], (), READ, "leave cells empty")
    yield Mistake("sentinel", MOTION, _sentinel, SHIFTS[:1], (), SHIFTS, "empty|slip|missing")
    yield Mistake("copied_cycle", MOTION, _copied_cycle, ("cycle",), (), ("cycle", *READ), "cop")
    told = ((), ("specimen", *READ), "cop")
    yield Mistake("copied_specimen", MOTION, _copied_specimen, ANGLES[:1], *told)
    yield Mistake("turned_in_ground", MOTION, _in_ground, ANGLES[:1], (), ANGLES, "ground")
    spoil = _times(SHIFTS[1:2], -1.0)
    yield Mistake("compression_positive", MOTION, spoil, SHIFTS[1:2], BOTH, SHIFTS[1:2], "sign of")


FRESH = (*_of_places(), *_of_loads(), *_of_readings())
"""36 kinds; none is one of `mistaken_cases.MISTAKES`."""


def _tests_exchanged(table: pd.DataFrame) -> None:
    names = list(dict.fromkeys(table["test"]))
    if len(names) > 1:
        pairs = {names[0]: names[1], names[1]: names[0]}
        table["test"] = table["test"].replace(pairs)


def _joints_reversed(table: pd.DataFrame) -> None:
    names = sorted(set(table["joint"]))
    table["joint"] = table["joint"].replace(dict(zip(names, names[::-1], strict=True)))


def _shifted(column: str, by: float) -> Table:
    def spoil(table: pd.DataFrame) -> None:
        table[column] += by

    return spoil


def _from_the_top(table: pd.DataFrame) -> None:
    """Heights counted downwards from above the head."""
    table["y_mm"] = 900.0 - table["y_mm"]


def _clipped(table: pd.DataFrame) -> None:
    """An encoder that ends at half of the largest reading."""
    for column in ANGLES:
        if column in table:
            limit = table[column].abs().max() / 2.0
            table[column] = table[column].clip(-limit, limit)


def _drift(table: pd.DataFrame) -> None:
    """5 deg more from the first to the last step."""
    there = [name for name in ANGLES if name in table]
    for _, rows in _series(table):
        table.loc[rows.index, there] += (
            5.0 * (rows["step"] / rows["step"].max()).to_numpy()[:, None]
        )


def _sides_of_one(table: pd.DataFrame) -> None:
    """Left and right exchanged in the middle vertebra alone."""
    names = list(dict.fromkeys(table["vertebra"]))
    rows = table["vertebra"] == names[len(names) // 2]
    sides = {"left_pedicle_base": "right_pedicle_base", "left_pedicle": "right_pedicle"}
    both = sides | {new: old for old, new in sides.items()}
    table.loc[rows, "landmark"] = table.loc[rows, "landmark"].replace(both)


def _of_last() -> Iterator[Mistake]:
    told = (BOTH, ("test", *READ), "test|sign of")
    yield Mistake("tests_exchanged", MOTION, _tests_exchanged, ANGLES[:1], *told)
    told = ((), ("joint", *READ), "joint|vertebrae")
    yield Mistake("motion_joints_reversed", MOTION, _joints_reversed, ANGLES[:1], *told)
    spoil = _times(ANGLES, 60.0)
    yield Mistake("arcminutes", MOTION, spoil, ANGLES[:1], BOTH, ANGLES, "minutes|unit|degrees")
    yield Mistake("com_z_aside", BODIES, _shifted("com_z_mm", 100.0), COM, (), COM[2:], "misplaced")
    told = ((), XYZ[1:2], "downwards|sign of y_mm|reverse")
    yield Mistake("joints_from_the_top", JOINTS, _from_the_top, XYZ, *told)
    spoil = _times(COM, 0.1, _first_specimen)
    yield Mistake("one_specimen_com_cm", BODIES, spoil, COM, (), COM, "in cm")
    spoil = _times(MOMENTS, 100.0)
    yield Mistake("moments_n_cm", LOADS, spoil, MOMENTS, BOTH, MOMENTS, "N cm|unit|N mm")
    spoil = _times(FORCES, 0.1)
    yield Mistake("forces_dan", LOADS, spoil, FORCES, BOTH, (*FORCES, *READ), "daN|unit|kN")
    yield Mistake("clipped", MOTION, _clipped, ANGLES[:1], (), ANGLES, "same|clip|end")
    yield Mistake("drift", MOTION, _drift, ANGLES[:1], BOTH, READ, "drift|step 0|sign")
    told = ((), ("landmark", *XYZ), "left and right")
    yield Mistake("sides_of_one", LANDMARKS, _sides_of_one, XYZ, *told)


LAST = tuple(_of_last())
"""Written down when the rules for `FRESH` were made, and scored once, at the end."""
