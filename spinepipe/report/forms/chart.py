"""A figure: panels of one or more forms, what explains them, and a caption.

It is drawn once for three uses. As SVG each panel is a drawing of its own inside the file, so that
a page can lay the panels out by the width of the screen and text keeps its size; as PDF and PNG,
for papers, all panels stand in a grid.
"""

import io
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from markupsafe import Markup
from markupsafe import escape as markup_escape
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D

from spinepipe.report.forms.look import COLORS, TEXT, Look, look

SVG = "http://www.w3.org/2000/svg"
GAP = 16.0
WIDEST = 948.0
"""Of a figure as one file, in units of a panel."""

LEGEND_HIGH = 20.0
DPI = 200


@dataclass(frozen=True, kw_only=True)
class Panel(ABC):
    """One panel, as a form draws it.

    Attributes
    ----------
    title : a few words; nothing where the figure has one panel.
    x_label, y_label : with unit and positive direction.
    width : units; text has 11.5. A phone is 380 wide.
    """

    title: str = ""
    x_label: str = ""
    y_label: str = ""
    width: float = 300.0

    @property
    @abstractmethod
    def height(self) -> float:
        """In units, by what is to be shown."""

    @abstractmethod
    def draw(self, axes: Axes) -> None:
        """Draw on empty axes; title and labels of the axes are there already."""


@dataclass(frozen=True)
class Key:
    """What a symbol or line stands for. ``line``: without symbol, ``points``: without line."""

    look: Look
    words: str
    as_line: bool = False
    hollow: bool = False

    def handle(self) -> Artist:
        """As a legend shows it."""
        how = self.look.line() if self.as_line else self.look.points(self.hollow)
        return Line2D([], [], label=self.words, **how)


@dataclass(frozen=True)
class Chart:
    """A figure.

    Attributes
    ----------
    title : what it shows. keys : nothing where labels stand beside what they name.
    caption : two sentences at most: what to see, and what is drawn.
    """

    title: str
    panels: Sequence[Panel]
    caption: str
    keys: Sequence[Key] = ()

    def svg(self) -> str:
        """The file that a page takes apart (see `Drawing`) and a document shows as it is."""
        with look():
            parts = [_drawn(panel) for panel in self.panels]
            if self.keys:
                parts.insert(0, _legend(self.keys))
            drawn = [(_part(figure), size) for figure, size in parts]
        placed, width, y = [], 0.0, 0.0
        for line in _lines([size for _, size in drawn], legend=bool(self.keys)):
            x = 0.0
            for index in line:
                part, (wide, high) = drawn[index]
                part = _own_ids(part, f"{index}")
                kind = "panel legend" if self.keys and index == 0 else "panel"
                placed.append(
                    f'<svg class="{kind}" x="{x:.0f}" y="{y:.0f}" width="{wide:.0f}" '
                    f'height="{high:.0f}" viewBox="0 0 {wide:.0f} {high:.0f}" '
                    f'style="max-width: {1.4 * wide:.0f}px">{part}</svg>'
                )
                x += wide + GAP
            width = max(width, x - GAP)
            y += max(drawn[index][1][1] for index in line) + GAP
        return (
            f'<svg xmlns="{SVG}" xmlns:xlink="http://www.w3.org/1999/xlink" '
            f'viewBox="0 0 {width:.0f} {y:.0f}" width="{width:.0f}" height="{y:.0f}" '
            'font-family="DejaVu Sans, Verdana, sans-serif">'
            f"<title>{escape(self.title)}</title><desc>{escape(self.caption)}</desc>"
            f"{''.join(placed)}</svg>\n"
        )

    def picture(self, kind: str) -> bytes:
        """All panels as one ``pdf`` or ``png`` with a white ground, the same bytes each time."""
        lines = _lines([(panel.width, panel.height) for panel in self.panels])
        across = max(map(len, lines))
        highs = [max(self.panels[index].height for index in line) for line in lines]
        wide = sum(
            max(self.panels[line[i]].width for line in lines if i < len(line))
            for i in range(across)
        )
        below = LEGEND_HIGH * ceil(len(self.keys) / max(1, across)) + 4.0 if self.keys else 0.0
        with look():
            size = ((wide + GAP * across) / 72.0, (sum(highs) + GAP * len(lines) + below) / 72.0)
            figure = Figure(figsize=size, layout="constrained", facecolor="white")
            grid = figure.subfigures(len(lines), across, squeeze=False, height_ratios=highs)
            for row, line in enumerate(lines):
                for column, index in enumerate(line):
                    _draw(self.panels[index], grid[row][column])
            if self.keys:
                handles = [key.handle() for key in self.keys]
                figure.legend(handles=handles, loc="outside lower center", ncols=across)
            content = io.BytesIO()
            metadata = {"pdf": {"CreationDate": None}, "png": {"Software": None}}[kind]
            figure.savefig(content, format=kind, dpi=DPI, facecolor="white", metadata=metadata)
        return content.getvalue()


def saying(title: str, message: str) -> Chart:
    """A figure that has nothing to show and says why."""
    return Chart(title, [_Message(message=message)], message)


_LETTERS = 40
"""In a line of a message."""


@dataclass(frozen=True, kw_only=True)
class _Message(Panel):
    message: str

    @property
    def lines(self) -> list[str]:
        return textwrap.wrap(self.message, _LETTERS)

    @property
    def height(self) -> float:
        return 8.0 + 16.0 * len(self.lines)

    def draw(self, axes: Axes) -> None:
        axes.set_axis_off()
        text = axes.text(0.0, 0.5, "\n".join(self.lines), transform=axes.transAxes, va="center")
        text.set(color=COLORS["soft"], in_layout=False)  # it is wider than the axes


def _draw(panel: Panel, figure: FigureBase) -> None:
    """A panel alone on a figure or a part of one; its title begins at the left edge."""
    axes = figure.subplots()
    if panel.title:
        style = {"size": TEXT + 1.0, "weight": "bold", "color": COLORS["ink"]}
        figure.suptitle(panel.title, x=0.0, ha="left", **style)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    panel.draw(axes)


def _drawn(panel: Panel) -> tuple[Figure, tuple[float, float]]:
    size = (panel.width, panel.height)
    figure = Figure(figsize=(size[0] / 72.0, size[1] / 72.0), layout="constrained")
    _draw(panel, figure)
    return figure, size


def _legend(keys: Sequence[Key]) -> tuple[Figure, tuple[float, float]]:
    """A strip as wide as a phone at most, so many side by side as their words allow."""
    wide = 360.0
    longest = max(len(key.words) for key in keys) * 7.2 + 44.0
    across = max(1, min(len(keys), int(wide // longest)))
    size = (max(wide, longest), LEGEND_HIGH * ceil(len(keys) / across))
    figure = Figure(figsize=(size[0] / 72.0, size[1] / 72.0))
    handles = [key.handle() for key in keys]
    figure.legend(
        handles=handles, loc="upper left", ncols=across, borderpad=0.0, borderaxespad=0.1,
        handlelength=2.0, columnspacing=1.2, bbox_to_anchor=(0.0, 1.0),
    )  # fmt: skip
    return figure, size


def _lines(sizes: Sequence[tuple[float, float]], legend: bool = False) -> list[list[int]]:
    """Numbers of the panels, line by line; a legend is the first, alone in its line."""
    lines: list[list[int]] = [[0]] if legend else []
    wide = WIDEST + 1.0
    for index in range(int(legend), len(sizes)):
        wide += sizes[index][0] + GAP
        if wide > WIDEST:
            lines.append([])
            wide = sizes[index][0]
        lines[-1].append(index)
    return lines


_STYLE_OF_ALL = re.compile(r"<style.*?</style>", re.DOTALL)
_FONT = re.compile(r"font: (?:(bold|[0-9]+) )?([0-9.]+)px [^;\"]*")
_LONG = re.compile(r"-?\d+\.\d{3,}")


def _part(figure: Figure) -> str:
    """The elements of a drawing: no heading, no style of its own, coordinates to 0.01 units."""
    content = io.StringIO()
    figure.savefig(content, format="svg", metadata={"Date": None})
    text = content.getvalue()
    inside = text[text.index("<defs>") : text.rindex("</svg>")]
    inside = _STYLE_OF_ALL.sub("", inside).replace("<defs>\n  \n </defs>", "")
    inside = _FONT.sub(_font, inside)
    inside = re.sub(r"font-family: [^;\"]*;? ?", "", inside)
    inside = re.sub(r' transform="rotate\(-0 [^"]*\)"', "", inside)
    inside = re.sub(r'<path d="[^"]*" style="fill: none"/>', "", inside)  # grounds
    inside = _LONG.sub(lambda found: f"{float(found.group()):.2f}".rstrip("0").rstrip("."), inside)
    inside = re.sub(r"<!--.*?-->", "", inside, flags=re.DOTALL)
    inside = re.sub(r">\s+<", "><", inside)
    inside = re.sub(r"\s*\n([A-Za-z]?)\s*", r"\1", inside)  # path data without line breaks
    used = dict.fromkeys(re.findall(r'(?:href="|url\()#([^")]+)', inside))
    inside = re.sub(r' id="([^"]+)"', lambda at: at.group() if at.group(1) in used else "", inside)
    for number, name in enumerate(used):
        inside = inside.replace(name, f"{number}")
    while (less := re.sub(r"<g></g>|<g/>|<g>((?:(?!</?g\b).)*)</g>", r"\1", inside)) != inside:
        inside = less  # groups that say nothing
    return inside


def _font(found: re.Match[str]) -> str:
    weight = f"; font-weight: {found.group(1)}" if found.group(1) else ""
    return f"font-size: {found.group(2)}px{weight}"


def _own_ids(part: str, prefix: str) -> str:
    """Names of elements are unique in a file of several panels."""
    part = re.sub(r'\bid="', f'id="p{prefix}-', part)
    return re.sub(r'(href="|url\()#', rf"\1#p{prefix}-", part)


@dataclass(frozen=True)
class Drawing:
    """A figure's file as a page has it: its panels apart, its colours those of the page.

    Attributes
    ----------
    panels : SVG elements. least_px : narrower than this text of a panel is too small.
    """

    name: str
    title: str
    caption: str
    panels: tuple[str, ...]
    least_px: int = 260

    @classmethod
    def read(cls, name: str, svg: str) -> "Drawing":
        """From the text of the file that `Chart.svg` made."""
        ElementTree.register_namespace("", SVG)
        ElementTree.register_namespace("xlink", "http://www.w3.org/1999/xlink")
        root = ElementTree.fromstring(svg)
        title = root.findtext(f"{{{SVG}}}title", "")
        caption = root.findtext(f"{{{SVG}}}desc", "")
        panels, widest = [], 0.0
        for child in root.findall(f"{{{SVG}}}svg"):
            for place in ("x", "y"):
                child.attrib.pop(place, None)
            if "legend" not in child.attrib["class"]:
                widest = max(widest, float(child.attrib["width"]))
            text = ElementTree.tostring(child, encoding="unicode")
            panels.append(_own_ids(_with_variables(text), f"{name}-"))
        return cls(name, title, caption, tuple(panels), round(0.9 * widest))

    def labelled(self, says: str) -> list[Markup]:
        """The panels as elements of a page; a reader who cannot see them is told ``says``."""
        role = f'<svg role="img" aria-label="{markup_escape(says)}" '
        return [Markup(panel.replace("<svg ", role, 1)) for panel in self.panels]


def _with_variables(text: str) -> str:
    for name, color in COLORS.items():
        text = text.replace(color, f"var(--{name})")
    return text
