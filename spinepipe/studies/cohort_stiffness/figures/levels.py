"""An axis of levels, cranial on the left."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from spinepipe.report.cohort.named import short

_SHARE = 0.82
_SHADE = "#F2F2F2"
_MOST_LETTERS = 140
"""Letters that stand side by side below a panel of the whole width."""


def places(
    level: int, specimens: Sequence[str], representations: Sequence[str]
) -> dict[tuple[str, str], float]:
    """Where each specimen and representation stands within a level."""
    keys = [(specimen, name) for specimen in specimens for name in representations]
    n = len(keys)
    return {key: level + _SHARE * ((i + 0.5) / n - 0.5) for i, key in enumerate(keys)}


def shade(axis: Axes, n: int) -> None:
    """Every second level a shade darker."""
    for level in range(0, n, 2):
        axis.axvspan(level - 0.5, level + 0.5, color=_SHADE, lw=0, zorder=0)
    axis.set_xlim(-0.5, n - 0.5)


def label_levels(axis: Axes, levels: Sequence[str]) -> None:
    """Names below the axis, slanted where they are long."""
    slanted = sum(len(name) + 2 for name in levels) > _MOST_LETTERS
    names = [short(name) for name in levels]
    turned = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
    axis.set_xticks(range(len(levels)), names, **turned)  # type: ignore[arg-type]
    axis.tick_params(axis="x", length=0.0)
