"""Pages over studies, from the templates beside this file and the frame of all pages."""

from importlib.resources import files

from spinepipe.report.page.study_page import rendered as with_frame

_HERE = "spinepipe.report.overview"


def rendered(template: str, **shown: object) -> str:
    """A page; whatever is shown is text, never markup."""
    style = files(_HERE).joinpath("pages.css").read_text("utf-8")
    return with_frame(template, (_HERE,), style, **shown)
