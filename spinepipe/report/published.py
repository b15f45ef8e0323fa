"""A paper whose cohort was rebuilt: its numbers stand beside results of that cohort alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spinepipe.anatomy import published


@dataclass(frozen=True)
class Reproduction:
    """A paper and its cohort.

    Attributes
    ----------
    paper : name of its numbers, see `spinepipe.anatomy.published`.
    cohort : name of the cohort that was rebuilt from it.
    cited : the paper as figures and captions name it.
    """

    paper: str
    cohort: str
    cited: str

    def stands_for(self, cohort: str) -> bool:
        """Whether this cohort was rebuilt from it: only then may results be held against it."""
        return cohort == self.cohort

    def beside(self, cohort: str) -> tuple[str, Mapping[str, Any]] | None:
        """How it is cited, and its numbers, for the cohort that was rebuilt from it, else None."""
        return (self.cited, published(self.paper)) if self.stands_for(cohort) else None
