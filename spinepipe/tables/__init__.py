"""Result tables: one schema each, from which files are checked and the docs are generated."""

from spinepipe.tables.identification import (
    AGAINST,
    BOOTSTRAP,
    COUNTS,
    LANDMARK_PRECISION,
    METHOD_FITS,
    PRECISION_ERRORS,
    REQUIRED_PRECISION,
    SUCCESS,
    SUCCESS_BY_METHOD,
    SUMMARY,
)
from spinepipe.tables.joint_pose_sensitivity import CALIBRATIONS, LANDMARKS, POSES, SIMULATIONS
from spinepipe.tables.parquet import (
    BadTable,
    from_rows,
    join,
    read,
    read_frame,
    read_frames,
    to_arrow,
    write,
)
from spinepipe.tables.schema import Column, Table
from spinepipe.tables.statistics import AGREEMENT, IMPORTANCE, STATISTICS, VARIANCE_SHARES

TABLES = {
    table.name: table
    for table in (
        LANDMARKS,
        POSES,
        CALIBRATIONS,
        SIMULATIONS,
        SUCCESS,
        COUNTS,
        SUMMARY,
        BOOTSTRAP,
        METHOD_FITS,
        SUCCESS_BY_METHOD,
        PRECISION_ERRORS,
        LANDMARK_PRECISION,
        REQUIRED_PRECISION,
        STATISTICS,
        AGREEMENT,
        VARIANCE_SHARES,
        IMPORTANCE,
        AGAINST,
    )
}

__all__ = [
    "AGAINST",
    "AGREEMENT",
    "BOOTSTRAP",
    "CALIBRATIONS",
    "COUNTS",
    "IMPORTANCE",
    "LANDMARKS",
    "LANDMARK_PRECISION",
    "METHOD_FITS",
    "POSES",
    "PRECISION_ERRORS",
    "REQUIRED_PRECISION",
    "SIMULATIONS",
    "STATISTICS",
    "SUCCESS",
    "SUCCESS_BY_METHOD",
    "SUMMARY",
    "TABLES",
    "VARIANCE_SHARES",
    "BadTable",
    "Column",
    "Table",
    "from_rows",
    "join",
    "read",
    "read_frame",
    "read_frames",
    "to_arrow",
    "write",
]
