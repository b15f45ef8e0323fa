"""How each model is drawn, the same in every figure: colour, line and mark."""

from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from spinepipe.report.style import BLUE, GREEN, GREY, PURPLE, VERMILLION, Dashes
from spinepipe.studies.scoliosis.words import IN_WORDS


@dataclass(frozen=True)
class ModelStyle:
    """What tells a model from the others, in colour and without."""

    color: str
    marker: str
    dashes: Dashes

    def line(self, **how: Any) -> dict[str, Any]:
        """Settings of a line."""
        return {"color": self.color, "ls": self.dashes, "lw": 1.0, **how}


DASHED: Dashes = (0, (4, 2))
"""What reading films alone makes."""

STYLES = {
    "tangent": ModelStyle(BLUE, "o", "-"),
    "tangent_fitted": ModelStyle(GREEN, "s", (0, (6.0, 1.5))),
    "linear_regions": ModelStyle(VERMILLION, "^", (0, (4.0, 2.0))),
    "linear_per_segment": ModelStyle(PURPLE, "D", (0, (2.0, 1.5))),
    "uniform": ModelStyle(GREY, "v", (0, (1.0, 1.0))),
}


def key_of_lines(models: list[str]) -> list[Line2D]:
    """Lines of a legend."""
    return [Line2D([], [], **STYLES[name].line(), label=IN_WORDS[name]) for name in models]


def axis_lines(axis: Axes) -> None:
    """Ticks of an upright axis that is a scale, not a list."""
    axis.tick_params(axis="y", size=2.5, width=0.6)
