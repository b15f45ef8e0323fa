"""Cohort folders: measured specimens, validated; the format is documented with every column."""

from spinepipe.cohort.cohort import Cohort, joint_names
from spinepipe.cohort.header import MeasurementSd
from spinepipe.cohort.read import read

__all__ = ["Cohort", "MeasurementSd", "joint_names", "read"]
