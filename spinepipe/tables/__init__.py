"""Result tables: one schema each, from which files are checked and the docs are generated."""

from spinepipe.tables.joint_pose_sensitivity import (
    CALIBRATIONS,
    LANDMARKS,
    POSES,
    SIMULATIONS,
    TABLES,
)
from spinepipe.tables.parquet import BadTable, join, read, read_frame, to_arrow, write
from spinepipe.tables.schema import Column, Table

__all__ = [
    "CALIBRATIONS",
    "LANDMARKS",
    "POSES",
    "SIMULATIONS",
    "TABLES",
    "BadTable",
    "Column",
    "Table",
    "join",
    "read",
    "read_frame",
    "to_arrow",
    "write",
]
