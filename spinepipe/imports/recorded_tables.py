"""Tables beside recorded markers: force plates, a lifted box, published moments.

They are turned into ground axes, mm, N, N m and deg, and into loads that act on the person
or on the upper vertebra.
"""

from collections.abc import Iterator, Mapping
from math import pi
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field

from spinepipe.cohort.cohort import FORM
from spinepipe.effects.contract import Array
from spinepipe.imports.imported import all_forms
from spinepipe.motion.reading_plates import read_force_plates
from spinepipe.motion.reading_text import NumberBlock, text_of
from spinepipe.problems import InputError, InputProblem, did_you_mean, one_of

QUANTITIES: Mapping[str, tuple[str, float]] = {
    f"{what}_{unit}": (f"{what}_{ours}", per)
    for names, ours, units in (
        (("time",), "s", {"s": 1.0, "ms": 1e-3}),
        (("fx", "fy", "fz"), "n", {"n": 1.0, "kn": 1e3}),
        (("mx", "my", "mz"), "nm", {"nm": 1.0, "nmm": 1e-3}),
        (("x", "y", "z"), "mm", {"mm": 1.0, "cm": 10.0, "m": 1000.0}),
        (("inclination",), "deg", {"deg": 1.0, "rad": 180.0 / pi}),
    )
    for what in names
    for unit, per in units.items()
}
"""Column of our tables, and what one unit of a file is in it, by how settings name a column."""

SIDES = {"force_plates": ("person", "plate"), "measured_moments": ("upper", "lower")}
"""On what loads of a table act: as ours do, and turned round."""

VECTORS = ("f{}_n", "m{}_nm", "{}_mm")

Place = tuple[str, int | None, str]

Parts = dict[str, dict[str, Array]]
"""Our columns by name, of each force plate; of other tables under an empty name."""


class RecordedTable(BaseModel):
    """A kind of table beside the markers: one file for each trial that has it."""

    model_config = FORM

    table: Literal["force_plates", "box", "measured_moments"] = Field(description="what it holds")
    file: str = Field(description="path, relative to this YAML, with `{specimen}` and `{trial}`")
    columns: tuple[str, ...] = Field(
        default=(),
        strict=False,
        description="what each column is, in order: `time_s`, `fx_n`, `my_nm`, `z_m`, "
        "`inclination_rad` and the like, on the axes of the file; of a force plate after its name "
        "and a point, `left.fx_n`; `-`: not read. Of a .c3d: none",
    )
    first_line: int = Field(default=1, ge=1, description="line of the first numbers")
    acts_on: Literal["person", "plate", "upper", "lower"] | None = Field(
        default=None, description="on what loads act: person or plate, upper or lower vertebra"
    )
    joint: str = Field(default="", description="joint of measured_moments")
    method: str = Field(default="", description="how measured_moments were obtained")

    @property
    def is_c3d(self) -> bool:
        """Whether plates are in the recordings of markers, on their clock."""
        return self.file.lower().endswith(".c3d")


def misnamed_columns(place: Place, of: RecordedTable) -> Iterator[InputProblem]:
    """Names of columns that such a table has not or has twice; loads not told on what they act."""
    meant = list[tuple[str, str]]()
    allowed = [
        name for name, (ours, _) in QUANTITIES.items() if ours in all_forms()[of.table].names
    ]
    for text in [one for one in of.columns if one != "-"]:
        part, _, name = text.rpartition(".")
        if name not in allowed or bool(part) > (of.table == "force_plates"):
            remedy = did_you_mean(name, allowed, "write `-` where a column is not read")
            yield InputProblem(*place, f"'{text}'", one_of(allowed), remedy)
            continue
        ours = QUANTITIES[name][0]
        if any(
            ours == other and ("" in (part, of_part) or part == of_part) for of_part, other in meant
        ):
            remedy = "correct it, or write `-` where a column is not read"
            yield InputProblem(*place, f"'{text}', which is told twice", "each column once", remedy)
        meant.append((part, ours))
    if not {"time_s", "time_ms"} & set(of.columns) and not of.is_c3d:
        yield InputProblem(*place, "no column of time", "time_s or time_ms", "name it")
    if of.table in SIDES and of.acts_on not in SIDES[of.table]:
        found, remedy = f"loads that act on '{of.acts_on}'", "say on what: `acts_on:`"
        yield InputProblem(*place, found, one_of(SIDES[of.table]), remedy)


def read_recorded_table(path: Path, file: str, of: RecordedTable, turn: Array) -> Parts:
    """Columns of a file in our units and on ground axes; NaN where nothing was measured.

    Parameters
    ----------
    file : its name in messages. turn : (3, 3) axes of ground (rows) on those of the file.

    Raises
    ------
    InputError
        Of a row of another width, of a cell that is no number, of times that are empty or run
        backwards, and where there is nothing.
    """
    parts = _plates(path, file) if of.is_c3d else _columns(path, file, of)
    if not parts or not all(len(values["time_s"]) for values in parts.values()):
        found = "no force plates" if of.is_c3d else "no rows"
        raise InputError([InputProblem(file, None, None, found, "numbers", "look at it")])
    reaction = -1.0 if of.acts_on in ("plate", "lower") else 1.0
    # each of ground's axes is one of the file's, to one side or the other
    places = np.argmax(np.abs(turn), axis=1)
    signs = turn[np.arange(3), places]
    for values in parts.values():
        for form, side in zip(VECTORS, (reaction, reaction, 1.0), strict=True):
            on_file = [values.pop(form.format(axis), None) for axis in "xyz"]
            for axis, place, sign in zip("xyz", places, signs, strict=True):
                if (component := on_file[place]) is not None:
                    values[form.format(axis)] = side * sign * component
    return parts


def _columns(path: Path, file: str, of: RecordedTable) -> Parts:
    """Columns of a text in our units, on the axes of the file."""
    rows = text_of(path, file).split("\n")[of.first_line - 1 :]
    columns = of.columns
    block = NumberBlock(file, "\n".join(rows), of.first_line, len(columns), columns.__getitem__)
    numbers, _ = block.numbers()
    parts: Parts = {one.rpartition(".")[0]: {} for one in columns if "." in one} or {"": {}}
    for part, values in parts.items():
        for text, column in zip(columns, numbers.T, strict=True):
            whose, _, name = text.rpartition(".")
            if text != "-" and whose in ("", part):
                ours, per = QUANTITIES[name]
                values[ours] = per * column
                if ours == "time_s":
                    block.check_times(values[ours], text, may_stand=True)
    return parts


def _plates(path: Path, file: str) -> Parts:
    """Force plates of a `.c3d`, by their number in it, on the axes of the file."""
    parts = Parts()
    for number, plate in enumerate(read_force_plates(path, file=file), start=1):
        loads = (plate.force, plate.free_moment, 1000.0 * plate.centre_of_pressure)
        columns = {
            form.format(axis): column
            for form, load in zip(VECTORS, loads, strict=True)
            for axis, column in zip("xyz", load.T, strict=True)
        }
        parts[str(number)] = {"time_s": plate.time_s, **columns}
    return parts
