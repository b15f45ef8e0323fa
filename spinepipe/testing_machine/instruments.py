"""Keys of the YAML that say what an instrument reads: a camera, encoders, a load cell."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from spinepipe.cohort.cohort import FORM

Point = Annotated[
    tuple[Annotated[float, Field(ge=-10_000, le=10_000)], ...],
    Field(min_length=3, max_length=3, strict=False),
]
_Shift = Literal["anterior", "posterior", "superior", "inferior", "right", "left"]
SYNC = "signal of both clocks"
"""In the place of a joint: a column by which clocks are compared."""


class Rotations(BaseModel):
    """How three angles of a joint make one rotation."""

    model_config = FORM

    order: Literal["xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "helical"] = Field(
        description="axes in the order in which they are turned about: x anterior, y superior, z "
        "to the right; helical: columns are the components of angle times axis"
    )
    axes: Literal["body", "space"] = Field(
        default="body",
        description="body: about axes that the rotations before have turned (Euler, Cardan); "
        "space: about axes that stay",
    )


class LoadCell(BaseModel):
    """A cell that reads the loads, along ground axes and about its own centre."""

    model_config = FORM

    reads: Literal["action", "reaction"] = Field(
        description="action: what acts on the loaded vertebra; reaction: what answers it, as the "
        "base below the segment does: all signs turn"
    )
    point_mm: Point | None = Field(
        default=None,
        description="its centre: anterior, superior, to the right in ground, neutral pose; moments "
        "are moved from there to `load_point_mm`; null: not moved",
    )
    tare_s: float | None = Field(
        default=None, gt=0, le=3600, description="the mean of the first so many seconds is no load"
    )


class MarkerClusters(BaseModel):
    """Markers of a camera, in clusters on the vertebrae."""

    model_config = FORM

    clusters: dict[str, Annotated[tuple[str, ...], Field(min_length=3, strict=False)]] = Field(
        description="names of the three or more markers of each vertebra; the lowest may be left "
        "out if it stays"
    )
    columns: str = Field(
        default="{marker} {axis}", description="names of columns; {axis}: x, y or z"
    )
    unit: Literal["mm", "m"] = Field(default="mm", description="unit of its numbers")
    axes: Annotated[tuple[_Shift, ...], Field(min_length=3, max_length=3, strict=False)] = Field(
        default=("anterior", "superior", "right"), description="where its x, y and z go"
    )
