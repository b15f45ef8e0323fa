"""A cohort of six T12-S1 specimens whose true stiffness is known, for checking what studies find.

It shares no code with spinepipe: it is one of the things spinepipe is tested against.
"""

from .cohort import Phantom, phantom
from .write import write

__all__ = ["SEED", "Phantom", "phantom", "write"]

SEED = 2024
"""Of the phantom in config/cohorts."""
