"""The documentation as a site: it is built without a warning, and reads without a network.

Catches dead links and anchors, pages that the menu lacks, and anything that a browser would fetch.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from spinepipe.reference.pages import table_pages

ROOT = Path(__file__).resolve().parents[2]
MOST_WORDS, MOST_LINES = 20_000, 110

pytestmark = pytest.mark.slow

_FETCHED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio|link(?![^>]*rel=["']?canonical))\b[^>]*?"""
    r"""(?:src|href)=["']?(?:https?:)?//|url\(["']?(?:https?:)?//|@import\s+["'](?:https?:)?//"""
)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    told = os.environ | {"PYTHONPATH": path, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=told, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_every_page_is_there(site: Path) -> None:
    written = [one.relative_to(ROOT / "docs").as_posix() for one in (ROOT / "docs").rglob("*.md")]
    for place in {*written, *table_pages(), "changes.md", "measured/validation/coverage.md"}:
        assert (site / place).with_suffix(".html").is_file(), place


def test_the_menu_has_every_page() -> None:
    told = (ROOT / "mkdocs.yml").read_text("utf-8") + (ROOT / "docs" / "hooks.py").read_text(
        "utf-8"
    )
    for path in (*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "studies").glob("*.md")):
        assert path.relative_to(ROOT / "docs").as_posix() in told, path


def test_nothing_is_fetched_from_a_network(site: Path) -> None:
    for path in (*site.rglob("*.html"), *site.rglob("*.css")):
        found = _FETCHED.search(path.read_text("utf-8"))
        assert found is None, (path, found and found[0])


def test_the_search_is_of_the_site_itself(site: Path) -> None:
    index = (site / "search" / "search_index.js").read_text("utf-8")
    assert "cohort_stiffness" in index
    assert 'src="site/iframe-worker.js"' in (site / "index.html").read_text("utf-8")


def test_the_first_page_leads_on(site: Path) -> None:
    first = (site / "index.html").read_text("utf-8")
    article = first[first.index("<article") : first.index("</article>")]
    assert set(re.findall(r'href="([a-z-]+)\.html"', article)) >= {"tutorial", "limits", "import"}


def test_it_can_be_read_in_an_hour_or_two() -> None:
    """Words by hand, of README and pages; decisions, generated parts and measured tables apart."""
    words = 0
    for path in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md")):
        place = path.relative_to(ROOT).as_posix()
        if not place.startswith(("docs/decisions/", "docs/table/", "docs/mutants.md")):
            text = re.sub(r"<!-- generated: .*?<!-- end", "", path.read_text("utf-8"), flags=re.S)
            words += sum(re.search(r"\w", word) is not None for word in text.split())
    assert words <= MOST_WORDS
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= MOST_LINES
