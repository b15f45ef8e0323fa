"""What a result table is: columns with type, unit, range and meaning. The docs come from here."""

from dataclasses import dataclass

import pyarrow as pa

from spinepipe.status import Status
from spinepipe.units import COORDINATES, TRANSLATIONS

TYPES = {
    "text": pa.string(),
    "integer": pa.int32(),
    "number": pa.float64(),
    "flag": pa.bool_(),
}


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    kind : ``text``, ``integer``, ``number`` or ``flag``.
    null : whether cells may be empty, and if so what an empty cell means; None forbids it.
    low, high : closed range of numbers.
    allowed : the only values a text may take.
    """

    name: str
    kind: str
    meaning: str
    unit: str = ""
    null: str | None = None
    low: float | None = None
    high: float | None = None
    allowed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """One result table: its rows are unique by ``key``."""

    name: str
    about: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]

    @property
    def schema(self) -> pa.Schema:
        """Arrow schema; columns that may be empty are nullable."""
        return pa.schema(
            pa.field(column.name, TYPES[column.kind], nullable=column.null is not None)
            for column in self.columns
        )

    def without(self, *names: str) -> "Table":
        """The table with some columns left out (those that a folder name carries)."""
        return Table(
            self.name,
            self.about,
            tuple(name for name in self.key if name not in names),
            tuple(column for column in self.columns if column.name not in names),
        )


SPECIMEN = Column("specimen", "text", "name of the specimen")
POSE = Column("pose", "integer", "number of the sampled joint pose, from 0", low=0)
JOINT = Column("joint", "text", "joint, upper vertebra first: L4L5 is L4 moving on L5")
MESSAGE = Column("message", "text", "what a reader should know about the status; often empty")

_DIRECTIONS = {
    "anterior": "translation, positive forwards",
    "superior": "translation, positive upwards (compression is negative)",
    "right": "translation, positive to the right",
    "extension": "rotation, positive in extension (flexion is negative)",
    "right_bending": "rotation, positive in bending to the right",
    "left_rotation": "rotation, positive in axial rotation to the left",
}


def status(of: str) -> Column:
    """Status column of a table of solves."""
    return Column("status", "text", f"how the {of} ended", allowed=tuple(Status))


def length_or_angle(coordinate: str) -> str:
    """``mm`` or ``deg``."""
    return "mm" if coordinate in TRANSLATIONS else "deg"


def coordinates(prefix: str, meaning: str, null: str | None) -> tuple[Column, ...]:
    """Six columns ``<prefix>_<coordinate>_<unit>``."""
    return tuple(
        Column(
            f"{prefix}_{name}_{length_or_angle(name)}",
            "number",
            f"{meaning}: {_DIRECTIONS[name]}",
            unit=length_or_angle(name),
            null=null,
        )
        for name in COORDINATES
    )


def stiffness_unit(coordinate: str) -> tuple[str, str]:
    """Suffix and unit of a stiffness."""
    return ("n_per_m", "N/m") if coordinate in TRANSLATIONS else ("nm_per_rad", "N m/rad")
