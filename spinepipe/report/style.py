"""How figures look: size, type, colours that colour-blind readers tell apart, and saving."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from spinepipe.marks import write_marked

BLACK, GREY, WHITE = "#000000", "#767676", "#FFFFFF"
BLUE, GREEN, VERMILLION = "#0072B2", "#009E73", "#D55E00"
PURPLE, SKY = "#CC79A7", "#56B4E9"
"""Okabe and Ito, Color Universal Design, 2008: the last two are reddish purple and sky blue."""

EMPTY, HATCH = "#E4E4E4", "#9A9A9A"
"""Cells of a map where nothing was read, and the lines across those that say why."""

INK = {BLUE: "#005A8E", GREEN: "#00694D", VERMILLION: "#A84A00", GREY: "#555555"}
"""Darker tones of some of them, for small print."""

OURS, BEST, THEIRS = BLUE, GREEN, VERMILLION
"""Each pose's own results, the best sets, and the paper's numbers, in every figure."""

WIDTH_MM = 180.0
"""Two columns of a journal page."""

TALLEST_MM = 230.0
SMALL_PT = 6.0
DPI = 300
_MM_PER_INCH = 25.4

# The font comes with matplotlib and text is drawn as outlines: the same picture everywhere.
_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.labelsize": 7.0,
    "axes.titlesize": 7.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 0.0,
    "xtick.minor.size": 1.5,
    "xtick.minor.width": 0.4,
    "lines.linewidth": 0.9,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "spinepipe",
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.06,
}


@contextmanager
def style() -> Iterator[None]:
    """Matplotlib's settings for a figure of ours; figures are made and saved inside."""
    settings: dict[str, Any] = dict(mpl.rcParamsDefault.items())
    settings.update(_STYLE, backend="agg")
    with mpl.rc_context(rc=settings):  # type: ignore[arg-type]
        yield


def blank(height_mm: float, width_mm: float = WIDTH_MM) -> Figure:
    """An empty figure of that size whose panels make room for their labels."""
    height = min(height_mm, TALLEST_MM)
    return Figure(figsize=(width_mm / _MM_PER_INCH, height / _MM_PER_INCH), layout="constrained")


def saying(message: str) -> Figure:
    """A figure that has nothing to show and says why."""
    figure = blank(40.0)
    figure.text(0.5, 0.5, fill(message, 100), ha="center", va="center", color=GREY, fontsize=9.0)
    return figure


def note(panel: Axes, x: float, y: float, words: str, color: str = BLACK, **how: Any) -> None:
    """Small text at a share of the panel's width and a row's height."""
    across = panel.get_yaxis_transform()
    settings = {"fontsize": SMALL_PT, "va": "center", "color": INK.get(color, color), **how}
    behind = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4}
    panel.text(x, y, words, transform=across, bbox=behind, in_layout=False, **settings)


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


_NO_DATE: dict[str, dict[str, None]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
}
"""Kinds of pictures, and what of their metadata changes from run to run."""


def picture(figure: Figure, kind: str) -> bytes:
    """A figure as the bytes of an ``svg``, ``png`` or ``pdf``, always the same."""
    content = io.BytesIO()
    if figure.axes and (layout := figure.get_layout_engine()) is not None:
        # solved once, for all kinds alike; saving with an engine would draw everything twice
        FigureCanvasSVG(figure)
        figure.set_dpi(DPI)
        layout.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(content, format=kind, dpi=DPI, metadata=_NO_DATE[kind])
    return content.getvalue()


def save(figure: Figure, path: str | Path, digest: str = "") -> None:
    """Write a picture, SVG, PNG or PDF by its name; it appears whole or not at all.

    Parameters
    ----------
    digest : what it hangs on, see `spinepipe.marks`; only results of a study have one.

    Raises
    ------
    ValueError
        For any other kind of picture.
    """
    path = Path(path)
    kind = path.suffix.removeprefix(".")
    if kind not in _NO_DATE:
        raise ValueError(f"{path.name}: a picture is .svg, .png or .pdf")
    write_marked(picture(figure, kind), path, digest)
