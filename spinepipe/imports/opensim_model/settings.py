"""The small YAML that says what is what in an OpenSim model."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Field

from spinepipe.cohort.cohort import FORM, VertebraName
from spinepipe.motion.reading import axes_of


def _axes(text: str) -> str:
    axes_of(text)
    return text


class OsimSettings(BaseModel):
    """The keys of the file."""

    model_config = FORM

    kind: Literal["opensim_model"] = Field(description="what the file is")
    cohort: str = Field(
        pattern=r"^[a-z0-9_]+$", description="name of the cohort folder that is made"
    )
    title: str = Field(min_length=1, description="one line that says what the cohort is")
    source: str = Field(min_length=1, description="who made the model, from what; licence")
    file: str = Field(min_length=1, description="the .osim, relative to this YAML")
    specimen: str | None = Field(
        default=None, description="what the specimen is called; null: as the model"
    )
    vertebrae: dict[VertebraName, str] | None = Field(
        default=None,
        description="bodies that are vertebrae, such as `{S1: pelvis, L5: lumbar5}`, and no "
        "others; null: those whose names say so",
    )
    axes: Annotated[str, AfterValidator(_axes)] = Field(
        default="x y z",
        description="what forwards, up and right are in the axes of the model, as in `x z -y` "
        "where z is up and y to the left",
    )
