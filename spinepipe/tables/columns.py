"""Columns that several tables share."""

from spinepipe.statics.status import Status
from spinepipe.tables.schema import Column
from spinepipe.units import COORDINATES, TRANSLATIONS

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
