"""What a study of joint counts asks."""

from pydantic import Field

from spinepipe.studies.study import Study


class JointCount(Study):
    """How many joints a specimen has, times a number."""

    times: int = Field(default=1, ge=1, description="what each count is multiplied by")
    shown: str = Field(default="bars", description="what the report says of the figure")
