"""The viewer as a part of a page: its element, its style and its script."""

from collections.abc import Sequence
from importlib.resources import files

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from spinepipe.report.viewer.scene import Scene, as_script, scenes_as_data
from spinepipe.report.viewer.still import still, telling_step

_SHOWN = {
    "measured": "Measured pose (dashed)",
    "loads": "Loads",
    "muscles": "Muscles",
    "markers": "Markers (rings: measured, dots: model)",
}
"""Parts of a step that can be switched off, in words."""


def viewer_html(scenes: Sequence[Scene], chooser: str = "Specimen") -> Markup:
    """A figure that shows one of the scenes at a time; nothing without scenes.

    It needs `viewer_style` in the page's head and `viewer_script` behind the last figure, each
    once. The still, and the place of the slider at the start, are the step of the first scene that
    moves most.
    """
    if not scenes:
        return Markup("")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    first = telling_step(scenes[0])
    steps = [step for scene in scenes for step in scene.steps]
    there = {
        "measured": any(step.measured is not None for step in steps),
        "loads": any(step.loads for step in steps),
        "muscles": any(step.muscles for step in steps),
        "markers": any(step.markers is not None for step in steps),
    }
    text = environment.from_string(_part("viewer.html")).render(
        scenes=scenes,
        chooser=chooser,
        label=f"{scenes[0].title}: {', '.join(body.name for body in scenes[0].bodies)} in 3-D",
        shown=[(name, words) for name, words in _SHOWN.items() if there[name]],
        first=first,
        data=Markup(as_script(scenes_as_data(scenes))),  # nothing in it could end the element
        still=Markup(still(scenes[0], first)),  # names in it are escaped there
    )
    return Markup(text)


def viewer_style() -> Markup:
    """Rules of the viewer for a style element; colours are variables of the page."""
    return Markup(_part("viewer.css"))


def viewer_script() -> Markup:
    """The script for a script element behind the last viewer of the page."""
    return Markup(_part("viewer.js"))


def _part(name: str) -> str:
    return files("spinepipe.report.viewer").joinpath(name).read_text(encoding="utf-8")
