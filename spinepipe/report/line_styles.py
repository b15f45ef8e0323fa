"""What tells one of several apart in all figures of a kind: colour, line and mark."""

from dataclasses import dataclass
from typing import Any

from spinepipe.report.style import WHITE

PURPLE, SKY = "#CC79A7", "#56B4E9"
"""Okabe and Ito's reddish purple and sky blue."""

Dashes = str | tuple[int, tuple[float, ...]]


@dataclass(frozen=True)
class LineStyle:
    """Colour, line and mark of one of several, told apart without colour too."""

    color: str
    marker: str
    dashes: Dashes

    def line(self, hollow: bool = False, **how: Any) -> dict[str, Any]:
        """Settings of a line with marks; hollow where it is not to be trusted."""
        face = WHITE if hollow else self.color
        look = {"color": self.color, "ls": self.dashes, "marker": self.marker, "lw": 1.0}
        return {**look, "ms": 3.4, "mec": self.color, "mfc": face, "mew": 0.8, **how}
