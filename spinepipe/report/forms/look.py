"""How figures look: colours by what they stand for, type, lines and symbols.

Colours are those of Okabe and Ito (Color Universal Design, 2008), darkened so that each has a
contrast of 4.5 to 1 on white; any two also differ by symbol or dash. A page puts a variable of its
style sheet in the place of each, so that a figure follows light and dark.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl

COLORS = {
    "ink": "#1a1d20",
    "soft": "#565e66",
    "line": "#d8dde1",
    "grid": "#e8ebee",
    "paper": "#ffffff",
    "base": "#b8410b",
    "model": "#0b62a8",
    "third": "#00735a",
    "fourth": "#93397d",
}
"""Names are those of the variables of the page's style sheet."""

Dashes = str | tuple[int, tuple[float, ...]]


@dataclass(frozen=True)
class Look:
    """Colour, symbol and dashes of one of several."""

    color: str
    marker: str
    dashes: Dashes = "-"

    def line(self, **how: Any) -> dict[str, Any]:
        """Of a line without symbols."""
        return {"color": self.color, "ls": self.dashes, "lw": 1.8, **how}

    def points(self, hollow: bool = False, **how: Any) -> dict[str, Any]:
        """Of symbols without a line; hollow where they are not to be trusted."""
        face = COLORS["paper"] if hollow else self.color
        own = {"color": self.color, "marker": self.marker, "ls": "", "ms": 5.5}
        return {**own, "mfc": face, "mec": self.color, "mew": 1.2, **how}


MEASURED = Look(COLORS["ink"], "o")
BASE = Look(COLORS["base"], "s", (0, (4.0, 2.5)))
MODEL = Look(COLORS["model"], "o")
THIRD = Look(COLORS["third"], "^", (0, (1.0, 1.5)))
FOURTH = Look(COLORS["fourth"], "D", (0, (6.0, 1.5, 1.0, 1.5)))
SOFT = Look(COLORS["soft"], "v", (0, (2.0, 2.0)))
SEVERAL = (MODEL, BASE, THIRD, FOURTH, SOFT, MEASURED)
"""Of several that are alike in rank, in this order."""

TEXT, SMALL = 11.5, 10.0
"""Size of type and of small print, in units of a panel."""

_STYLE: Mapping[str, Any] = {
    "backend": "agg",
    "font.family": "DejaVu Sans",  # comes with matplotlib, and is wider than what a page has
    "font.size": TEXT,
    "axes.titlesize": TEXT + 1.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": COLORS["ink"],
    "axes.labelsize": TEXT,
    "axes.labelcolor": COLORS["soft"],
    "axes.edgecolor": COLORS["soft"],
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.facecolor": "none",
    "grid.color": COLORS["grid"],
    "grid.linewidth": 0.9,
    "text.color": COLORS["ink"],
    "xtick.color": COLORS["soft"],
    "ytick.color": COLORS["soft"],
    "xtick.labelsize": TEXT,
    "ytick.labelsize": TEXT,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0,
    "legend.frameon": False,
    "legend.fontsize": TEXT,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "spinepipe",
    "figure.dpi": 72.0,  # a unit of a panel is a point
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
}


@contextmanager
def look() -> Iterator[None]:
    """Matplotlib's settings for figures of ours; figures are made and saved inside."""
    settings: dict[str, Any] = dict(mpl.rcParamsDefault.items())
    settings.update(_STYLE)
    with mpl.rc_context(rc=settings):  # type: ignore[arg-type]
        yield
