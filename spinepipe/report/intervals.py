"""How an estimate with its interval is drawn."""

from matplotlib.axes import Axes

from spinepipe.report.style import WHITE

CROWDED_ALPHA = 0.5


def draw_interval(
    panel: Axes, x: float, ends: tuple[float, float], y: float, color: str, crowded: bool = False
) -> None:
    """A dot with a line from end to end; fainter where many share a row."""
    alpha = CROWDED_ALPHA if crowded else 1.0
    panel.plot(ends, [y, y], color=color, lw=1.2, alpha=alpha, solid_capstyle="butt", zorder=3)
    panel.plot(
        [x], [y], "o", color=color, ms=3.0 if crowded else 4.0, mec=WHITE, mew=0.4, alpha=alpha,
        zorder=4, clip_on=False,
    )  # fmt: skip
