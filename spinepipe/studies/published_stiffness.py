"""Published stiffness that studies start from where a study file names none."""

from spinepipe.anatomy import published
from spinepipe.studies.coordinates import Stiffness

__all__ = ["published_stiffness"]


def published_stiffness() -> Stiffness:
    """Gould 2024b, Table 2, the same at all joints."""
    given = published("gould_2024b")["uniform_stiffness"]
    return Stiffness(**{name: float(value) for name, value in given.items() if name != "where"})
