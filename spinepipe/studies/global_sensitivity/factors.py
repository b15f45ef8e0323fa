"""Factors of a global sensitivity study: what is uncertain, where, and how far it is spread."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from spinepipe.studies.parts import FORM, Coordinate, EachOnce
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M, ROTATIONS, TRANSLATIONS


class Of(StrEnum):
    """What can be changed; offsets are in m and rad, everything else is multiplied."""

    STIFFNESS = "stiffness"
    LANDMARK = "landmark"
    JOINT_CENTRE = "joint_centre"
    JOINT_AXES = "joint_axes"
    LOAD_POINT = "load_point"
    LOAD_DIRECTION = "load_direction"
    LOAD_SIZE = "load_size"
    MASS = "mass"
    CENTRE_OF_MASS = "centre_of_mass"
    DAMPING = "damping"
    NOTHING = "nothing"


@dataclass(frozen=True)
class FactorChange:
    """One factor, its value left open.

    Attributes
    ----------
    at : names of joints or vertebrae; empty: of all.
    axis : place of the axis: of ground (x, y, z), of a joint frame, or of a coordinate among the
        six; 0 where there is none.
    landmark : name of the landmark that is moved.
    """

    of: Of
    at: tuple[str, ...] = ()
    axis: int = 0
    landmark: str = ""


_FORMS = "{low, high}, or {sd} with or without mean, low and high"


class _Spread(BaseModel):
    """Ends of a uniform spread, or the SD of a normal one, which ends may cut off."""

    model_config = FORM

    per_si: ClassVar[float]
    unit: ClassVar[str]
    unchanged: ClassVar[float]
    """What changes nothing: 0 of offsets, 1 of multipliers."""

    low: float | None
    high: float | None
    mean: float | None
    sd: float | None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if self.sd is None and (self.mean is not None or None in (self.low, self.high)):
            raise ValueError(f"one of two forms: {_FORMS}")
        between = None if self.sd is None else self.middle
        inside = [end for end in (self.low, between, self.high) if end is not None]
        if any(above <= below for below, above in pairwise(inside)):
            raise ValueError(f"low below {'mean, mean below ' if self.sd else ''}high")
        return self

    @property
    def middle(self) -> float:
        """Mean of a normal spread, median of a log-normal one."""
        return self.unchanged if self.mean is None else self.mean


class Millimetres(_Spread):
    """An offset along an axis: uniform from low to high, or normal."""

    per_si: ClassVar[float] = MM_PER_M
    unit: ClassVar[str] = "mm"
    unchanged: ClassVar[float] = 0.0

    low: float | None = Field(default=None, ge=-200, le=200, description="lowest offset, mm")
    high: float | None = Field(default=None, ge=-200, le=200, description="highest offset, mm")
    mean: float | None = Field(
        default=None, ge=-200, le=200, description="mean of a normal offset, mm; null: 0"
    )
    sd: float | None = Field(
        default=None,
        gt=0,
        le=50,
        description="SD of a normal offset, mm (before low and high cut it off); null: uniform",
    )


class Degrees(_Spread):
    """A turn about an axis: uniform from low to high, or normal."""

    per_si: ClassVar[float] = DEG_PER_RAD
    unit: ClassVar[str] = "deg"
    unchanged: ClassVar[float] = 0.0

    low: float | None = Field(default=None, ge=-90, le=90, description="lowest angle, deg")
    high: float | None = Field(default=None, ge=-90, le=90, description="highest angle, deg")
    mean: float | None = Field(
        default=None, ge=-90, le=90, description="mean of a normal angle, deg; null: 0"
    )
    sd: float | None = Field(
        default=None,
        gt=0,
        le=45,
        description="SD of a normal angle, deg (before low and high cut it off); null: uniform",
    )


class Times(_Spread):
    """A multiplier: log-uniform from low to high, or log-normal."""

    per_si: ClassVar[float] = 1.0
    unit: ClassVar[str] = "1"
    unchanged: ClassVar[float] = 1.0

    low: float | None = Field(default=None, ge=1e-4, le=1e4, description="lowest multiplier")
    high: float | None = Field(default=None, ge=1e-4, le=1e4, description="highest multiplier")
    mean: float | None = Field(
        default=None,
        ge=1e-4,
        le=1e4,
        description="geometric mean of a log-normal multiplier; null: 1",
    )
    sd: float | None = Field(
        default=None,
        gt=0,
        le=3,
        description="SD of the natural logarithm of a log-normal multiplier (before low and high "
        "cut it off); null: log-uniform",
    )


AnySpread = Times | Millimetres | Degrees
"""How a factor can be spread."""


Label = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_]+$")]


GROUND_AXES = ("x", "y", "z")


class Factor(BaseModel):
    """One uncertain input."""

    model_config = FORM
    changes: ClassVar[Of]
    axes: ClassVar[Sequence[str]] = ()
    """Of those that have an axis, the names of all of these, in their order."""

    name: Label | None = Field(
        default=None, description="name in the tables; null: made of what the factor is"
    )
    group: Label | None = Field(
        default=None,
        description="factors of one group are taken together and get one index (sobol and morris)",
    )

    @property
    def label(self) -> str:
        """The name in the tables: `stiffness_L1L2_extension`."""
        change = self.change
        return self.name or "_".join((change.of.value, *change.at, *self._what))

    @property
    def change(self) -> FactorChange:
        """What it changes: these joints or bodies alike, all where none is named."""
        at = getattr(self, "joints", None) or getattr(self, "vertebrae", None) or ()
        axis = self.axes.index(str(self.axis)) if hasattr(self, "axis") else 0
        return FactorChange(self.changes, at, axis)

    @property
    def spread(self) -> AnySpread:
        """How its value is spread, as the file says it."""
        for key in ("times", "offset_mm", "offset_deg"):
            if hasattr(self, key):
                found: AnySpread = getattr(self, key)
                return found
        raise NotImplementedError

    @property
    def _what(self) -> tuple[str, ...]:
        """Words of the name that follow the places."""
        return (str(self.axis),) if hasattr(self, "axis") else ()


_Places = EachOnce[Annotated[str, StringConstraints(min_length=1)]]
_GroundAxis = Literal["x", "y", "z"]

_TIMES = Field(description="what it is multiplied by: {low, high} log-uniform, {sd} log-normal")
_OFFSET_MM = Field(description="how far it is moved, mm: {low, high} uniform, {sd} normal")
_OFFSET_DEG = Field(description="how far it is turned, deg: {low, high} uniform, {sd} normal")
_JOINTS = Field(default=None, description="joints, together; null: all")


class StiffnessFactor(Factor):
    """The stiffness of joints in one coordinate."""

    of: Literal["stiffness"] = Field(description="what is uncertain")
    coordinate: Coordinate = Field(description="coordinate whose stiffness it is")
    joints: _Places | None = _JOINTS
    times: Times = _TIMES

    @property
    def change(self) -> FactorChange:
        """One coordinate's stiffness, of these joints alike."""
        return FactorChange(Of.STIFFNESS, self.joints or (), COORDINATES.index(self.coordinate))

    @property
    def _what(self) -> tuple[str, ...]:
        return (self.coordinate,)


class LandmarkFactor(Factor):
    """The place of one landmark along one axis of ground."""

    of: Literal["landmark"] = Field(description="what is uncertain")
    vertebra: Annotated[str, StringConstraints(min_length=1)] = Field(
        description="vertebra it lies on"
    )
    landmark: Annotated[str, StringConstraints(min_length=1)] = Field(
        description="landmark of a joint frame, as in landmarks.csv"
    )
    axis: _GroundAxis = Field(description="axis of ground: x anterior, y superior, z right")
    offset_mm: Millimetres = _OFFSET_MM

    @property
    def change(self) -> FactorChange:
        """One landmark, along one axis."""
        axis = GROUND_AXES.index(self.axis)
        return FactorChange(Of.LANDMARK, (self.vertebra,), axis, self.landmark)

    @property
    def _what(self) -> tuple[str, ...]:
        return self.landmark.replace(" ", "_"), self.axis


class JointCentreFactor(Factor):
    """The origin of joint frames, along one of their own axes."""

    changes: ClassVar[Of] = Of.JOINT_CENTRE
    axes: ClassVar[Sequence[str]] = TRANSLATIONS
    of: Literal["joint_centre"] = Field(description="what is uncertain")
    joints: _Places | None = _JOINTS
    axis: Literal["anterior", "superior", "right"] = Field(description="axis of the joint frame")
    offset_mm: Millimetres = _OFFSET_MM


class JointAxesFactor(Factor):
    """The orientation of joint frames, about one of their own axes."""

    changes: ClassVar[Of] = Of.JOINT_AXES
    axes: ClassVar[Sequence[str]] = ROTATIONS
    of: Literal["joint_axes"] = Field(description="what is uncertain")
    joints: _Places | None = _JOINTS
    axis: Literal["extension", "right_bending", "left_rotation"] = Field(
        description="rotation of the joint about whose axis the frame is turned; of several at "
        "once, in the sequence Z, X', Y''"
    )
    offset_deg: Degrees = _OFFSET_DEG


class LoadPointFactor(Factor):
    """Where all loads of the chosen tests act, along one axis of ground."""

    changes: ClassVar[Of] = Of.LOAD_POINT
    axes: ClassVar[Sequence[str]] = GROUND_AXES
    of: Literal["load_point"] = Field(description="what is uncertain")
    axis: _GroundAxis = Field(description="axis of ground: x anterior, y superior, z right")
    offset_mm: Millimetres = _OFFSET_MM


class LoadDirectionFactor(Factor):
    """The direction of all loads of the chosen tests, force and moment together."""

    changes: ClassVar[Of] = Of.LOAD_DIRECTION
    axes: ClassVar[Sequence[str]] = GROUND_AXES
    of: Literal["load_direction"] = Field(description="what is uncertain")
    axis: _GroundAxis = Field(
        description="axis of ground about which loads are turned at their own points; angles "
        "about several axes are one rotation vector"
    )
    offset_deg: Degrees = _OFFSET_DEG


class LoadSizeFactor(Factor):
    """The size of all loads of the chosen tests, force and moment together; weight is no load."""

    changes: ClassVar[Of] = Of.LOAD_SIZE
    of: Literal["load_size"] = Field(description="what is uncertain")
    times: Times = _TIMES


class MassFactor(Factor):
    """Mass and inertia of vertebrae."""

    changes: ClassVar[Of] = Of.MASS
    of: Literal["mass"] = Field(description="what is uncertain")
    vertebrae: _Places | None = Field(
        default=None, description="vertebrae, together; null: all that move"
    )
    times: Times = _TIMES


class CentreOfMassFactor(Factor):
    """The centre of mass of vertebrae, along one axis of ground; loads keep their points."""

    changes: ClassVar[Of] = Of.CENTRE_OF_MASS
    axes: ClassVar[Sequence[str]] = GROUND_AXES
    of: Literal["centre_of_mass"] = Field(description="what is uncertain")
    vertebrae: _Places | None = Field(
        default=None, description="vertebrae, together; null: all that move"
    )
    axis: _GroundAxis = Field(description="axis of ground: x anterior, y superior, z right")
    offset_mm: Millimetres = _OFFSET_MM


class DampingFactor(Factor):
    """The damping of all joints; of equilibria it decides at most which are stable."""

    changes: ClassVar[Of] = Of.DAMPING
    of: Literal["damping"] = Field(description="what is uncertain")
    times: Times = _TIMES


AnyFactor = Annotated[
    StiffnessFactor
    | LandmarkFactor
    | JointCentreFactor
    | JointAxesFactor
    | LoadPointFactor
    | LoadDirectionFactor
    | LoadSizeFactor
    | MassFactor
    | CentreOfMassFactor
    | DampingFactor,
    Field(discriminator="of"),
]
"""A factor of any kind, told apart by `of`."""
