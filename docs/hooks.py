"""What the site has besides `docs/*.md`: a page for each table, measurements, changes.

Links that lead out of `docs/` lead to these pages, or stay as text where the file is no page.
"""

import re
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from spinepipe.reference.pages import table_pages

ROOT = Path(__file__).resolve().parents[1]

MEASURED = {
    "validation": ROOT / "tests" / "validation" / "results",
    "benchmarks": ROOT / "benchmarks" / "results",
}
"""Folders whose pages are of the site, by the folder there."""

PLACES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
} | {
    path.relative_to(ROOT).as_posix(): f"measured/{name}/{path.name.replace('README', 'all')}"
    for name, folder in MEASURED.items()
    for path in sorted(folder.glob("*.md"))
}
"""Where pages that lie outside of `docs/` stand in the site, by their place in the repository."""

PICTURES = {
    path.relative_to(ROOT).as_posix(): f"measured/{name}/{path.name}"
    for name, folder in MEASURED.items()
    for path in sorted(folder.glob("*.png"))
}
"""The same of pictures."""

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#]+)(#[^)\s]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add what is listed from the code and from folders to the menu."""
    tables: dict[str, list[Any]] = {}
    for place in table_pages():
        kind, _, name = place.removeprefix("table/").removesuffix(".md").partition("/")
        tables.setdefault(kind, []).append({name: place} if name else place)
    developers = next(part["Developers"] for part in config.nav or [] if "Developers" in part)
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    developers[:0] = [{"Contributing": "contributing.md"}, {"Changes": "changes.md"}]
    developers += [
        {"Decisions": [f"decisions/{path.name}" for path in decisions]},
        {"Measured": [place for place in PLACES.values() if place.startswith("measured/")]},
    ]
    results = next(part["Results"] for part in config.nav or [] if "Results" in part)
    results.append({"Tables": [{kind: pages} for kind, pages in tables.items()]})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that do not lie in `docs/`."""
    made = table_pages()
    for source, place in PLACES.items():
        if place != "index.md":
            made[place] = (ROOT / source).read_text(encoding="utf-8")
    for source, place in PICTURES.items():
        files.append(File.generated(config, place, abs_src_path=str(ROOT / source)))
    for place, text in made.items():
        written = files.get_file_from_path(place)  # `spinepipe docs` may have written it
        if written is not None:
            files.remove(written)
        files.append(File.generated(config, place, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links out of `docs/` to their place in the site; take away those without one."""
    here = page.file.src_uri
    elsewhere = (old for old, new in PLACES.items() if new == here != "index.md")
    source = next(elsewhere, f"docs/{here}")

    def lead(found: re.Match[str]) -> str:
        picture, words, target, anchor = found.groups()
        if "://" in target or target.startswith("mailto:"):
            return found[0]
        path = normpath(str(PurePosixPath(source).parent / target))
        place = PLACES.get(path) or PICTURES.get(path)
        if place is None and path.startswith("docs/"):
            place = path.removeprefix("docs/")
        if place is None or files.get_file_from_path(place) is None:
            return f"{words} (`{path}`)" if words.strip("`") != path else words
        return (
            f"{picture}[{words}]({relpath(place, str(PurePosixPath(here).parent))}{anchor or ''})"
        )

    parts = re.split(r"(^```.*?^```)", markdown, flags=re.DOTALL | re.MULTILINE)
    return "".join(part if part.startswith("```") else _LINK.sub(lead, part) for part in parts)
