"""What stands in ``cohort.yaml``."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

__all__ = ["CohortHeader", "MeasurementSd"]

FORM = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

VertebraName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9]*$")]


class MeasurementSd(BaseModel):
    """One standard deviation of one reading before zeroing, per component."""

    model_config = FORM

    rotation_deg: float = Field(gt=0, le=45, description="SD of a measured angle, deg")
    translation_mm: float = Field(gt=0, le=50, description="SD of a measured translation, mm")


class CohortHeader(BaseModel):
    """The keys of ``cohort.yaml``."""

    model_config = FORM

    cohort: str = Field(pattern=r"^[a-z0-9_]+$", description="the folder's name, [a-z0-9_]+")
    title: str = Field(min_length=1, description="one line that says what the cohort is")
    source: str = Field(
        min_length=1, description="citation, how the numbers were obtained, licence"
    )
    vertebrae: tuple[VertebraName, ...] = Field(
        strict=False,
        description="names from caudal to cranial, the first is fixed to ground",
    )
    gravity: bool = Field(description="true: 9.81 m/s2 along -y acts; false: no weight")
    zeroed_at_step_0: bool = Field(
        default=False, description="true: the step-0 coordinates were subtracted in every cycle"
    )
    measurement_sd: MeasurementSd | None = Field(
        default=None, description="standard deviations of one reading, may be left out"
    )
