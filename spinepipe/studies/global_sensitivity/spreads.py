"""How the value of a factor is spread, as a study file says it."""

from itertools import pairwise
from typing import ClassVar, Self

from pydantic import BaseModel, Field, model_validator

from spinepipe.studies.coordinates import FORM
from spinepipe.units import DEG_PER_RAD, MM_PER_M

__all__ = ["AnySpread", "Degrees", "Millimetres", "Times"]

_FORMS = "{low, high}, or {sd} with or without mean, low and high"


class _Spread(BaseModel):
    """Ends of a uniform spread, or the SD of a normal one, which ends may cut off."""

    model_config = FORM

    low: float | None
    high: float | None
    mean: float | None
    sd: float | None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if self.sd is None and (self.mean is not None or None in (self.low, self.high)):
            raise ValueError(f"one of two forms: {_FORMS}")
        inside = [end for end in (self.low, self._between, self.high) if end is not None]
        if any(above <= below for below, above in pairwise(inside)):
            raise ValueError(f"low below {'mean, mean below ' if self.sd else ''}high")
        return self

    @property
    def _between(self) -> float | None:
        """What must lie between the ends."""
        return None if self.sd is None else self.middle

    @property
    def middle(self) -> float:
        """Mean of a normal spread, median of a log-normal one."""
        raise NotImplementedError


class _Offset(_Spread):
    """An offset: uniform or normal."""

    per_si: ClassVar[float]
    unit: ClassVar[str]

    @property
    def middle(self) -> float:
        """Mean of a normal offset."""
        return 0.0 if self.mean is None else self.mean


class Millimetres(_Offset):
    """An offset along an axis: uniform from low to high, or normal."""

    per_si: ClassVar[float] = MM_PER_M
    unit: ClassVar[str] = "mm"

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


class Degrees(_Offset):
    """A turn about an axis: uniform from low to high, or normal."""

    per_si: ClassVar[float] = DEG_PER_RAD
    unit: ClassVar[str] = "deg"

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

    @property
    def middle(self) -> float:
        """Geometric mean, which is the median."""
        return 1.0 if self.mean is None else self.mean


AnySpread = Times | Millimetres | Degrees
"""How a factor can be spread."""
