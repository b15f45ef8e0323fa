"""What settings of studies are made of: stiffness, damping, weights, lists without repeats."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    create_model,
    model_validator,
)

from spinepipe.anatomy import published
from spinepipe.cohort import Cohort
from spinepipe.documents.names import distinct
from spinepipe.effects.contract import Array
from spinepipe.units import (
    COORDINATES,
    ROTATIONS,
    STIFFNESS_COLUMNS,
    STIFFNESS_UNITS,
    TRANSLATIONS,
)

FORM = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
"""Unknown keys, `yes` for a number and NaN are errors."""

Coordinate = Literal["anterior", "superior", "right", "extension", "right_bending", "left_rotation"]

_Translational = Annotated[float, Field(ge=1.0, le=1e9)]
_Rotational = Annotated[float, Field(ge=1e-4, le=1e6)]
_Weight = Annotated[float, Field(ge=0, le=1e6)]
_Millimetres = Annotated[float, Field(ge=-200, le=200)]


_Fields = TypeVar("_Fields", bound=BaseModel)

_IN_WORDS = {
    "anterior": "anterior",
    "superior": "superior",
    "right": "lateral",
    "extension": "flexion-extension",
    "right_bending": "lateral bending",
    "left_rotation": "axial rotation",
}
"""What the stiffness along each coordinate is called."""


def with_stiffness(
    defaults: Mapping[str, float] | None, coordinates: Sequence[str] = COORDINATES
) -> Callable[[type[_Fields]], type[_Fields]]:
    """Give a class of settings a field for the stiffness along each of these coordinates.

    Parameters
    ----------
    defaults : N/m and N m/rad by the names of the fields; None where each must be given.
    """

    def made(settings: type[_Fields]) -> type[_Fields]:
        fields: dict[str, Any] = {}
        for name, column in zip(COORDINATES, STIFFNESS_COLUMNS, strict=True):
            if name in coordinates:
                default = ... if defaults is None else float(defaults[column])
                about = f"{_IN_WORDS[name]} stiffness, {STIFFNESS_UNITS[name]}"
                kind = _Translational if name in TRANSLATIONS else _Rotational
                fields[column] = (kind, Field(default=default, description=about))
        return create_model(
            settings.__name__,
            __base__=settings,
            __doc__=settings.__doc__,
            __module__=settings.__module__,
            **fields,
        )

    return made


class _InOrder(BaseModel):
    model_config = FORM

    def in_order(self) -> tuple[float, ...]:
        """The values of the fields, in the order of the coordinates."""
        return tuple(dict(self).values())


@with_stiffness(dict(zip(STIFFNESS_COLUMNS, (24600, 110000, 13500, 37, 64, 268), strict=True)))
class DiagonalStiffness(_InOrder):
    """Diagonal stiffness of a joint."""


@with_stiffness(published("gould_2024b")["uniform_stiffness"])
class PublishedStiffness(DiagonalStiffness):
    """Diagonal stiffness of a joint; what is not named is that of Gould 2024b, Table 2, uniform."""


@with_stiffness(None, ROTATIONS)
class LevelStiffness(_InOrder):
    """Rotational stiffness of one joint, where joints differ."""


def stiffness_of_joints(
    cohort: Cohort, every: DiagonalStiffness, levels: Mapping[str, LevelStiffness]
) -> Array:
    """(J, 6) SI: one stiffness of all joints, with the rotations of levels that have their own."""
    values = np.tile(np.array(every.in_order(), dtype=float), (len(cohort.joint_names), 1))
    for joint, level in levels.items():
        values[cohort.joint_names.index(joint), len(TRANSLATIONS) :] = level.in_order()
    return values


class Damping(BaseModel):
    """Viscous damping of a joint; equilibria do not depend on it."""

    model_config = FORM

    translation_n_s_per_m: float = Field(
        default=1000.0, gt=0, le=1e7, description="damping of the three translations, N s/m"
    )
    rotation_nm_s_per_rad: float = Field(
        default=1.4, gt=0, le=1e5, description="damping of the three rotations, N m s/rad"
    )

    def in_order(self) -> tuple[float, ...]:
        """(6,) N s/m and N m s/rad in the order of the coordinates."""
        return (self.translation_n_s_per_m,) * 3 + (self.rotation_nm_s_per_rad,) * 3


class Weights(_InOrder):
    """Weights of the measured coordinates in the least squares, on mm and degrees."""

    anterior: _Weight = Field(default=10.0, description="weight of anterior motion, per mm2")
    superior: _Weight = Field(default=100.0, description="weight of superior motion, per mm2")
    right: _Weight = Field(default=1.0, description="weight of lateral motion, per mm2")
    extension: _Weight = Field(default=1.0, description="weight of extension, per deg2")
    right_bending: _Weight = Field(default=0.0, description="weight of right bending, per deg2")
    left_rotation: _Weight = Field(default=0.0, description="weight of left rotation, per deg2")

    @model_validator(mode="after")
    def _something_counts(self) -> Self:
        if not any(self.in_order()):
            raise ValueError("at least one weight above 0")
        return self


class Shift(_InOrder):
    """A shift in ground axes."""

    anterior: _Millimetres = Field(default=0.0, description="shift anterior, mm")
    superior: _Millimetres = Field(default=0.0, description="shift superior, mm")
    right: _Millimetres = Field(default=0.0, description="shift to the right, mm")


Item = TypeVar("Item")
EachOnce = Annotated[tuple[Item, ...], Field(strict=False, min_length=1), AfterValidator(distinct)]
"""One item at least, and none twice."""

Tests = EachOnce[Annotated[str, StringConstraints(min_length=1)]]
"""Load cases of a cohort."""

Coordinates = EachOnce[Coordinate]
"""Coordinates of a joint."""

AUTO: Literal["auto"] = "auto"
"""In place of coordinates: those that were loaded and measured (`spinepipe.studies.free`)."""


def _alone(names: tuple[str, ...]) -> tuple[str, ...]:
    if AUTO in names and len(names) > 1:
        raise ValueError(f"{AUTO} by itself, or coordinates")
    return distinct(names)


Free = Annotated[
    tuple[Literal[Coordinate, "auto"], ...],
    BeforeValidator(lambda given: (given,) if given == AUTO else given),
    Field(strict=False, min_length=1),
    AfterValidator(_alone),
]
"""Coordinates whose stiffness is fitted; `auto` until the cohort is known."""
