"""How tasks and persons are told apart in all figures of this kind, in colour and without."""

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from spinepipe.report.style import BLACK, BLUE, GREEN, PURPLE, SKY, VERMILLION, LineStyle
from spinepipe.report.words import plain, short

LOOKS = (
    LineStyle(BLACK, "o", "-"),
    LineStyle(BLUE, "s", (0, (6.0, 1.5))),
    LineStyle(VERMILLION, "^", (0, (4.0, 2.0))),
    LineStyle(GREEN, "D", (0, (2.0, 1.5))),
    LineStyle(PURPLE, "v", (0, (5.0, 1.5, 1.0, 1.5))),
    LineStyle(SKY, "P", (0, (1.0, 1.0))),
)

HOLLOW_WORDS = "Hollow: forces did not settle, or do not hold the task."


def look_of(number: int) -> LineStyle:
    """The look of one of several; they come again after the last."""
    return LOOKS[number % len(LOOKS)]


def key_of(labels: dict[str, LineStyle]) -> list[Line2D]:
    """Marks of a legend."""
    return [Line2D([], [], **look.line(), label=name) for name, look in labels.items()]


def task_label(name: str) -> str:
    """A task beside an axis."""
    return short(plain(name), 24)


def scale(axis: Axes) -> None:
    """Ticks of an upright axis that is a scale, not a list."""
    axis.tick_params(axis="y", size=2.5, width=0.6)
