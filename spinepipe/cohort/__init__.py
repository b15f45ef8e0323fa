"""Cohort folders: measured specimens, validated; the format is documented with every column."""

from spinepipe.cohort.cohort import Cohort, MeasurementSd, joint_names
from spinepipe.cohort.read import Reader, read

__all__ = ["Cohort", "MeasurementSd", "Reader", "joint_names", "read"]
