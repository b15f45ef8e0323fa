"""Pages over studies: one file each that loads nothing, from the templates beside this file."""

from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


def rendered(template: str, **shown: Any) -> str:
    """A page; whatever is shown is text, never markup."""
    environment = Environment(
        loader=PackageLoader("spinepipe.report.overview", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = files("spinepipe.report.overview").joinpath("pages.css").read_text("utf-8")
    return environment.get_template(template).render(style=Markup(style), **shown)
