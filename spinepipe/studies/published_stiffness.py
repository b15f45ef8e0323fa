"""Published stiffness that studies start from where a study file names none."""

from pydantic import BaseModel, Field

from spinepipe.anatomy import published
from spinepipe.studies.coordinates import FORM, Rotational, Stiffness, Translational

__all__ = ["LevelStiffness", "PublishedStiffness"]

_UNIFORM = {
    name: float(value)
    for name, value in published("gould_2024b")["uniform_stiffness"].items()
    if name != "where"
}


class PublishedStiffness(Stiffness):
    """Diagonal stiffness of a joint; what is not named is that of Gould 2024b, Table 2, uniform."""

    anterior_n_per_m: Translational = Field(
        default=_UNIFORM["anterior_n_per_m"], description="anterior stiffness, N/m"
    )
    superior_n_per_m: Translational = Field(
        default=_UNIFORM["superior_n_per_m"], description="superior stiffness, N/m"
    )
    right_n_per_m: Translational = Field(
        default=_UNIFORM["right_n_per_m"], description="lateral stiffness, N/m"
    )
    extension_nm_per_rad: Rotational = Field(
        default=_UNIFORM["extension_nm_per_rad"], description="flexion-extension stiffness, N m/rad"
    )
    right_bending_nm_per_rad: Rotational = Field(
        default=_UNIFORM["right_bending_nm_per_rad"],
        description="lateral bending stiffness, N m/rad",
    )
    left_rotation_nm_per_rad: Rotational = Field(
        default=_UNIFORM["left_rotation_nm_per_rad"],
        description="axial rotation stiffness, N m/rad",
    )


class LevelStiffness(BaseModel):
    """Rotational stiffness of one joint, where joints differ."""

    model_config = FORM

    extension_nm_per_rad: Rotational = Field(description="flexion-extension stiffness, N m/rad")
    right_bending_nm_per_rad: Rotational = Field(description="lateral bending stiffness, N m/rad")
    left_rotation_nm_per_rad: Rotational = Field(description="axial rotation stiffness, N m/rad")

    def in_order(self) -> tuple[float, ...]:
        """(3,) N m/rad in the order of the rotations."""
        return tuple(dict(self).values())
