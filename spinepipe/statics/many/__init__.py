"""Many spines of one structure at once, for designs of thousands of samples."""

from spinepipe.statics.many.solve import ManySolved, solve_many
from spinepipe.statics.many.spines import Cases, Spines

__all__ = ["Cases", "ManySolved", "Spines", "solve_many"]
