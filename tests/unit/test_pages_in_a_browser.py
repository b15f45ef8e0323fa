"""Pages of results in Chromium: nobody's name runs, nothing is fetched, no script fails.

Skipped where no Chromium is installed.

Catches a script that fails, a name that runs, an address that is fetched.
"""

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import stored_studies
from hostile import PAYLOAD, renamed
from made_pages import page_of
from made_results import MAKERS, made

from spinepipe.report.overview.index import write_index

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or ""
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-quic"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom"),
)
RUNS = re.sub(r"alert\((\d)\)", r"document.documentElement.dataset.ran=\1", PAYLOAD)
"""The payload, so that the page itself tells when a part of it ran."""

FAR = "http://example.org/x.png"
BROWSER = "not an origin"
"""Said of requests that no page makes: the clock, updates."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="no Chromium is installed here"),
    pytest.mark.filterwarnings("ignore:constrained_layout not applied:UserWarning"),
]


@dataclass(frozen=True)
class Seen:
    """What a browser made of a page: its elements, its addresses asked for, what scripts said."""

    elements: str
    asked_for: tuple[str, ...]
    said: tuple[str, ...]

    @property
    def ran(self) -> bool:
        """Whether a part of the payload ran."""
        head = re.search(r"<html[^>]*>", self.elements)
        return head is not None and "data-ran" in head.group()


def seen(page: str, folder: Path) -> Seen:
    """Open a page as somebody would who double-clicks it."""
    file, log = folder / "page.html", folder / "net.json"
    file.write_text(page, encoding="utf-8")
    own = (f"--user-data-dir={folder / 'profile'}", f"--log-net-log={log}")
    done = subprocess.run(
        [CHROMIUM, *QUIET, *own, file.as_uri()], capture_output=True, text=True, check=True
    )
    said = tuple(re.findall(r"CONSOLE.*", done.stderr))
    return Seen(done.stdout, tuple(_addresses(log)), said)


def _addresses(log: Path) -> list[str]:
    """What the page asked the network for; what the browser asks for itself has no origin."""
    told = [event.get("params", {}) for event in json.loads(log.read_text())["events"]]
    urls = {one["url"] for one in told if one.get("initiator", BROWSER) != BROWSER}
    return sorted(url for url in urls if not url.startswith(("file:", "data:", "blob:")))


def test_what_runs_and_what_is_fetched_would_be_seen(tmp_path: Path) -> None:
    page = f"<img src='{FAR}'><script>nothing.there()</script><p>{RUNS}</p>"
    told = seen(page, tmp_path)
    assert told.ran
    assert told.asked_for == (FAR,)
    assert any("nothing is not defined" in line for line in told.said)


@pytest.mark.parametrize("kind", sorted(MAKERS))
def test_names_do_not_run_and_the_page_needs_no_network(kind: str, tmp_path: Path) -> None:
    found = renamed(made(kind, tmp_path), RUNS, tmp_path)
    told = seen(page_of(found), tmp_path)
    assert told.elements.count("&lt;script&gt;document") > 3, "they do stand in the page"
    assert not told.ran
    assert told.asked_for == ()
    assert [line for line in told.said if "Error" in line or "Uncaught" in line] == []


def test_the_page_of_all_studies_is_searched_and_asks_for_nothing(tmp_path: Path) -> None:
    """What a reader looks for stays, groups without any of it go; no script fails."""
    root = stored_studies.project(tmp_path / "project")
    for name in (stored_studies.FIRST, stored_studies.SECOND):
        told = stored_studies.conclusion("answer", "r", "v", f"Only {name} says this. {RUNS}")
        stored_studies.store(root, name, [told])
    page = write_index(root, {}).read_text("utf-8")
    typed = (
        'const box = document.querySelector(".seek"); box.value = "%s"; box.oninput({target: box});'
    )
    for words, shown in (("only SECOND", ["second"]), ("nowhere", []), ("", ["second", "first"])):
        found = seen(page.replace("</body>", f"<script>{typed % words}</script></body>"), tmp_path)
        assert not found.said
        assert not found.asked_for
        assert not found.ran
        articles = re.findall(
            r'<article class="study"([^>]*)>.*?<b><a[^>]*>(\w+)<', found.elements, re.S
        )
        assert [name for hidden, name in articles if "hidden" not in hidden] == shown
        groups = re.findall(r'<section class="group"([^>]*)>', found.elements)
        assert all(("hidden" in one) == (not shown) for one in groups)
