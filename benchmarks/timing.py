"""Timing: CPU seconds of a call, medians over repeats, and what machine it was."""

import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Timed:
    """CPU seconds of repeated calls: median, least and largest."""

    median: float
    least: float
    largest: float
    repeats: int


def cpu_seconds(call: Callable[[], object], repeats: int, warm_up: int = 1) -> Timed:
    """Time a call ``repeats`` times after ``warm_up`` calls that do not count."""
    for _ in range(warm_up):
        call()
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return Timed(statistics.median(seconds), min(seconds), max(seconds), repeats)


def machine() -> dict[str, str]:
    """Processor, cores, memory and system, as a reader of the figures needs them."""
    lines = (
        Path("/proc/cpuinfo").read_text().splitlines() if os.path.exists("/proc/cpuinfo") else []
    )
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return {
        "processor": names[0] if names else platform.processor(),
        "cores": str(os.cpu_count()),
        "memory_gib": f"{pages / 2**30:.1f}",
        "system": platform.system(),
        "python": platform.python_version(),
    }
