"""What every study has, of whatever kind."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from pydantic import BaseModel, Field

from spinepipe.documents.names import COHORT_NAME, LONGEST_NAME
from spinepipe.studies.parts import FORM

__all__ = ["COHORTS", "STUDIES", "Study", "cohort_folder"]

COHORTS, STUDIES = Path("config") / "cohorts", Path("config") / "studies"


def cohort_folder(cohort: str, root: Path) -> Path:
    """Folder of a cohort; a plain name is one of ``config/cohorts``, ``./name`` a path.

    Parameters
    ----------
    cohort : as a study names it.
    root : folder of the Snakefile.
    """
    if COHORT_NAME.fullmatch(cohort):
        return root / COHORTS / cohort
    return root / cohort  # an absolute path replaces the root


class Study(BaseModel):
    """A question asked of one cohort: its kind, and the choices it leaves open."""

    model_config = FORM
    most_fits: ClassVar[Mapping[str, int]] = {}
    """Of the search of a kind that has one, by its effort; the search is the rule KIND_search."""

    study: str = Field(
        pattern=r"^[a-z0-9_]+$",
        max_length=LONGEST_NAME,
        description="the name, equal to the file's without .yaml",
    )
    kind: str = Field(description="kind of study")
    cohort: str = Field(
        min_length=1,
        description="a folder in config/cohorts, or a path relative to the Snakefile or absolute",
    )

    def cohort_folder(self, root: Path) -> Path:
        """Folder of the cohort, see the function of the same name."""
        return cohort_folder(self.cohort, root)
