"""The small YAML that says what is what in an OpenSim model."""

from typing import Literal

from pydantic import Field

from spinepipe.cohort.cohort import VertebraName
from spinepipe.imports.imported import AxesText, CohortTitle


class OsimSettings(CohortTitle):
    """The keys of the file."""

    kind: Literal["opensim_model"] = Field(description="what the file is")
    file: str = Field(min_length=1, description="the .osim, relative to this YAML")
    specimen: str | None = Field(
        default=None, description="what the specimen is called; null: as the model"
    )
    vertebrae: dict[VertebraName, str] | None = Field(
        default=None,
        description="bodies that are vertebrae, such as `{S1: pelvis, L5: lumbar5}`, and no "
        "others; null: those whose names say so",
    )
    axes: AxesText = Field(
        default="x y z",
        description="what forwards, up and right are in the axes of the model, as in `x z -y` "
        "where z is up and y to the left",
    )
