"""Factors of a global sensitivity study: what is uncertain, where, and how far it is spread."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from spinepipe.cohort.varied.change import Change, Of
from spinepipe.studies.coordinates import Coordinate
from spinepipe.studies.factor import Factor
from spinepipe.studies.lists import EachOnce
from spinepipe.studies.spreads import Degrees, Millimetres, Times
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

__all__ = ["AnyFactor"]

GROUND_AXES = ("x", "y", "z")

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
    def change(self) -> Change:
        """One coordinate's stiffness, of these joints alike."""
        return Change(Of.STIFFNESS, self.joints or (), COORDINATES.index(self.coordinate))

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
    def change(self) -> Change:
        """One landmark, along one axis."""
        axis = GROUND_AXES.index(self.axis)
        return Change(Of.LANDMARK, (self.vertebra,), axis, self.landmark)

    @property
    def _what(self) -> tuple[str, ...]:
        return self.landmark.replace(" ", "_"), self.axis


class JointCentreFactor(Factor):
    """The origin of joint frames, along one of their own axes."""

    of: Literal["joint_centre"] = Field(description="what is uncertain")
    joints: _Places | None = _JOINTS
    axis: Literal["anterior", "superior", "right"] = Field(description="axis of the joint frame")
    offset_mm: Millimetres = _OFFSET_MM

    @property
    def change(self) -> Change:
        """The origins of these joints alike."""
        return Change(Of.JOINT_CENTRE, self.joints or (), TRANSLATIONS.index(self.axis))


class JointAxesFactor(Factor):
    """The orientation of joint frames, about one of their own axes."""

    of: Literal["joint_axes"] = Field(description="what is uncertain")
    joints: _Places | None = _JOINTS
    axis: Literal["extension", "right_bending", "left_rotation"] = Field(
        description="rotation of the joint about whose axis the frame is turned; of several at "
        "once, in the sequence Z, X', Y''"
    )
    offset_deg: Degrees = _OFFSET_DEG

    @property
    def change(self) -> Change:
        """The frames of these joints alike."""
        return Change(Of.JOINT_AXES, self.joints or (), ROTATIONS.index(self.axis))


class LoadPointFactor(Factor):
    """Where all loads of the chosen tests act, along one axis of ground."""

    of: Literal["load_point"] = Field(description="what is uncertain")
    axis: _GroundAxis = Field(description="axis of ground: x anterior, y superior, z right")
    offset_mm: Millimetres = _OFFSET_MM

    @property
    def change(self) -> Change:
        """All load points alike."""
        return Change(Of.LOAD_POINT, axis=GROUND_AXES.index(self.axis))


class LoadDirectionFactor(Factor):
    """The direction of all loads of the chosen tests, force and moment together."""

    of: Literal["load_direction"] = Field(description="what is uncertain")
    axis: _GroundAxis = Field(
        description="axis of ground about which loads are turned at their own points; angles "
        "about several axes are one rotation vector"
    )
    offset_deg: Degrees = _OFFSET_DEG

    @property
    def change(self) -> Change:
        """All loads alike."""
        return Change(Of.LOAD_DIRECTION, axis=GROUND_AXES.index(self.axis))


class LoadSizeFactor(Factor):
    """The size of all loads of the chosen tests, force and moment together; weight is no load."""

    of: Literal["load_size"] = Field(description="what is uncertain")
    times: Times = _TIMES

    @property
    def change(self) -> Change:
        """All loads alike."""
        return Change(Of.LOAD_SIZE)


class MassFactor(Factor):
    """Mass and inertia of vertebrae."""

    of: Literal["mass"] = Field(description="what is uncertain")
    vertebrae: _Places | None = Field(
        default=None, description="vertebrae, together; null: all that move"
    )
    times: Times = _TIMES

    @property
    def change(self) -> Change:
        """Mass and inertia of these bodies alike."""
        return Change(Of.MASS, self.vertebrae or ())


class CentreOfMassFactor(Factor):
    """The centre of mass of vertebrae, along one axis of ground; loads keep their points."""

    of: Literal["centre_of_mass"] = Field(description="what is uncertain")
    vertebrae: _Places | None = Field(
        default=None, description="vertebrae, together; null: all that move"
    )
    axis: _GroundAxis = Field(description="axis of ground: x anterior, y superior, z right")
    offset_mm: Millimetres = _OFFSET_MM

    @property
    def change(self) -> Change:
        """The centres of these bodies alike."""
        return Change(Of.CENTRE_OF_MASS, self.vertebrae or (), GROUND_AXES.index(self.axis))


class DampingFactor(Factor):
    """The damping of all joints; of equilibria it decides at most which are stable."""

    of: Literal["damping"] = Field(description="what is uncertain")
    times: Times = _TIMES

    @property
    def change(self) -> Change:
        """All damping alike."""
        return Change(Of.DAMPING)


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
