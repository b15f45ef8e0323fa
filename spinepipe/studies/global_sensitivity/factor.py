"""What every factor of a global sensitivity study has, of whatever kind."""

from typing import Annotated

from pydantic import BaseModel, Field, StringConstraints

from spinepipe.cohort.varied.change import Change
from spinepipe.studies.coordinates import FORM
from spinepipe.studies.spreads import AnySpread

__all__ = ["Factor"]

Label = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_]+$")]


class Factor(BaseModel):
    """One uncertain input."""

    model_config = FORM

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
    def change(self) -> Change:
        """What it changes."""
        raise NotImplementedError

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
