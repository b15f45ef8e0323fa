"""How heavy pages of finished studies are, and how long a browser takes until they stand."""

import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
REPEATS = 3


def opened(root: Path = ROOT) -> Iterator[str]:
    """A line for each page below ``results``: kB, printed pages, ms until it stands (least of 3).

    Without Chromium the sizes alone.
    """
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    for page in sorted((root / "results").glob("*/report.html")):
        told = f"{page.parent.name}: {page.stat().st_size / 1e3:.0f} kB"
        if browser:
            seconds = min(_seconds(browser, page) for _ in range(REPEATS))
            told += f", {_printed(browser, page)} printed pages, {1e3 * seconds:.0f} ms to open"
        yield told


def _seconds(browser: str, page: Path) -> float:
    """Wall time of a browser that opens the page and ends, less one that opens nothing."""
    return _run(browser, "--dump-dom", page.as_uri()) - _run(browser, "--dump-dom", "about:blank")


def _run(browser: str, *asked: str) -> float:
    with tempfile.TemporaryDirectory() as folder:
        own = ("--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}")
        start = time.perf_counter()
        subprocess.run([browser, *own, *asked], capture_output=True, check=True)
        return time.perf_counter() - start


def _printed(browser: str, page: Path) -> int:
    with tempfile.TemporaryDirectory() as folder:
        pdf = Path(folder) / "page.pdf"
        _run(browser, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
        return len(re.findall(rb"/Type\s*/Page[^s]", pdf.read_bytes()))
