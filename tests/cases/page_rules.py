"""What must hold of every kind's sentences, figures and pages, whatever they say."""

import io
import re
from collections.abc import Iterable, Iterator
from html import unescape

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from spinepipe.report.conclusions import (
    MOST_WORDS,
    PLACES,
    Conclusion,
    Sentence,
    Told,
    sentences_of,
)
from spinepipe.report.forms import chart as charts
from spinepipe.report.forms.chart import Chart
from spinepipe.report.forms.look import look

MOST_KB_FIGURE, MOST_MB_PAGE = 60.0, 1.0
MOST_WORDS_BEFORE_FIGURE = 150

FORBIDDEN = (
    *("hangs on", "hang on", "told apart", "held out", "holds out", "noise SDs of", "settled"),
    *("made up", "made-up", "phantom", "declared", "nuisance", "imitate", "doubtful", "refusal"),
    *("reduced dataset", "ways of", "out of reach", "is pressed", "told by", "cannot be told"),
)
"""Words of our own that a reader does not know; what stands for them is in docs/glossary.md."""

_DUST = re.compile(r"\d[eE][-−]\d")
_SNAKE = re.compile(r"`|\b[a-z]+_[a-z_]+\b")
_FIELD = re.compile(r"\{[^}]*\}")


def faults_of_sentences(package: str) -> Iterator[str]:
    """What is wrong with a kind's table of sentences."""
    for row in sentences_of(package):
        where = f"{row.place} {row.rule} {row.verdict}"
        if row.place not in PLACES:
            yield f"{where}: no such place"
        if not row.false_if and row.place != "methods":
            yield f"{where}: what would make it false?"
        plain = _FIELD.sub("x", f"{row.heading} {row.text} {row.note}")
        yield from (f"{where}: '{word}'" for word in FORBIDDEN if word in plain.lower())
        if _SNAKE.search(plain):
            yield f"{where}: a name of the code in {plain!r}"


def faults_of_told(told: Iterable[Told]) -> Iterator[str]:
    """What is wrong with sentences as they stand on a page."""
    found = list(told)
    answers = [one for one in found if one.place == "answer"]
    if len(answers) != 1:
        yield f"{len(answers)} answers"
    for one in found:
        words = len(one.text.split())
        if one.place in ("answer", "finding") and words > MOST_WORDS:
            yield f"{words} words: {one.text}"
        if _DUST.search(one.text):
            yield f"solver's dust: {one.text}"
        if one.place == "key" and "value" not in one.values:
            yield f"a key number without its value: {one.rule}"
        if one.place == "light" and one.level not in ("ok", "check", "stop"):
            yield f"light {one.rule}: {one.verdict}"


def verdicts(conclusions: Iterable[Conclusion]) -> set[tuple[str, str]]:
    """Rules with the verdicts that they came to."""
    return {(one.rule, one.verdict) for one in conclusions}


def all_verdicts(sentences: Iterable[Sentence]) -> set[tuple[str, str]]:
    """Rules with all verdicts that have a sentence."""
    return {(row.rule, row.verdict) for row in sentences}


def faults_of_chart(chart: Chart) -> Iterator[str]:
    """Text that leaves its panel or stands over other text; a file that is too heavy."""
    size = len(chart.svg().encode()) / 1000.0
    if size > MOST_KB_FIGURE:
        yield f"{chart.title}: {size:.0f} kB"
    if not chart.caption or len(re.findall(r"[.!?](?:\s|$)", chart.caption)) > 2:
        yield f"{chart.title}: a caption has one or two sentences: {chart.caption!r}"
    with look():
        for panel in chart.panels:
            figure, (width, height) = charts._drawn(panel)
            FigureCanvasAgg(figure)
            figure.savefig(io.BytesIO(), format="png", dpi=72)
            renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
            unseen = {
                tick.label1
                for axes in figure.axes
                for axis in (axes.xaxis, axes.yaxis)
                for tick in axis.get_major_ticks()
                if not min(ends := axis.get_view_interval()) <= tick.get_loc() <= max(ends)
            }
            boxes = [
                (text.get_text(), text.get_window_extent(renderer))
                for text in figure.findobj(Text)
                if isinstance(text, Text)
                and text not in unseen
                and text.get_visible()
                and text.get_text().strip()
            ]
            boxes = [(words, box) for words, box in boxes if box.width > 0.0]
            for words, box in boxes:
                if box.x0 < -1.0 or box.y0 < -1.0 or box.x1 > width + 1.0 or box.y1 > height + 1.0:
                    yield f"{chart.title}, {panel.title}: {words!r} leaves its panel"
            for index, (words, box) in enumerate(boxes):
                for other, beside in boxes[index + 1 :]:
                    across = min(box.x1, beside.x1) - max(box.x0, beside.x0)
                    up = min(box.y1, beside.y1) - max(box.y0, beside.y0)
                    if across > 2.0 and up > 3.0:
                        yield f"{chart.title}, {panel.title}: {words!r} over {other!r}"


def faults_of_page(html: str) -> Iterator[str]:
    """Size, order and words of a page."""
    size = len(html.encode()) / 1e6
    if size > MOST_MB_PAGE:
        yield f"{size:.1f} MB"
    if re.search(r"(?:src|href)=\"(?:https?:)?//", html) or "@import" in html:
        yield "an address elsewhere"
    figure = html.find('<svg role="img"')
    before = html[html.index("<main") : figure if figure > 0 else html.index("<h2")]
    words = len(unescape(re.sub(r"<[^>]+>", " ", before)).split())
    if words > MOST_WORDS_BEFORE_FIGURE:
        yield f"{words} words before the first figure"
    if html.count('<article class="finding') > 5:
        yield "more than five findings"
    ids = re.findall(r'\sid="([^"]+)"', html)
    yield from (f"id {name} twice" for name in {name for name in ids if ids.count(name) > 1})
