"""How stiffness is fitted to measured motion, once per sample of a design."""

from pydantic import BaseModel, Field

from spinepipe.studies.coordinates import FORM, Weights
from spinepipe.studies.lists import Coordinates

__all__ = ["SampleCalibration"]


class SampleCalibration(BaseModel):
    """One stiffness for all joints of a specimen, from one starting point: the sample's own."""

    model_config = FORM

    free: Coordinates = Field(
        default=("anterior", "superior", "extension"),
        description="coordinates whose stiffness is fitted; the others keep the sample's",
    )
    weights: Weights = Field(default_factory=Weights, description="weights on mm and degrees")
    bound_factor: float = Field(
        default=1000.0, gt=1, le=1e9, description="bounds are start / factor and start x factor"
    )
    identifiable_below: float = Field(
        default=1.0,
        gt=0,
        le=100,
        description="a stiffness is identifiable when the standard error of its natural "
        "logarithm is below this",
    )
