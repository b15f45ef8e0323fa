"""What every study has, of whatever kind."""

import json
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from spinepipe.studies.coordinates import FORM

__all__ = ["COHORTS", "Study", "cohort_folder"]

COHORTS = Path("config") / "cohorts"
COHORT_NAME = re.compile(r"[a-z0-9_]+")


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

    study: str = Field(
        pattern=r"^[a-z0-9_]+$", description="the name, equal to the file's without .yaml"
    )
    kind: str = Field(description="kind of study")
    cohort: str = Field(
        min_length=1,
        description="a folder in config/cohorts, or a path relative to the Snakefile or absolute",
    )

    def cohort_folder(self, root: Path) -> Path:
        """Folder of the cohort, see the function of the same name."""
        return cohort_folder(self.cohort, root)

    def part(self, *names: str) -> str:
        """Canonical JSON of the named keys only, to digest what a result depends on.

        Parameters
        ----------
        names : keys, dotted where nested (``calibration.free``); their order does not matter.

        Raises
        ------
        KeyError
            For a key that the study does not have.
        """
        data = self.model_dump(mode="json")
        chosen = {name: _at(data, name) for name in names}
        return json.dumps(chosen, sort_keys=True, separators=(",", ":"))


def _at(data: dict[str, Any], dotted: str) -> object:
    value: Any = data
    for key in dotted.split("."):
        if not isinstance(value, dict) or key not in value:
            raise KeyError(f"no key '{dotted}' in a study")
        value = value[key]
    return value
