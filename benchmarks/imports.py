"""How long `import spinepipe` takes, and what a notebook waits for at the first use of a name."""

import subprocess
import sys
import time
from collections.abc import Iterator

GOAL_S = 0.5
REPEATS = 5
ASKED = ("import spinepipe", "import spinepipe as sp; sp.read_cohort; sp.calibrate")


def seconds() -> Iterator[str]:
    """A line for each: least of five, less a Python that imports nothing."""
    for code in ASKED:
        wall = min(_wall(code) for _ in range(REPEATS)) - min(_wall("") for _ in range(REPEATS))
        goal = f" (goal {GOAL_S} s)" if code == ASKED[0] else ""
        yield f"{code}: {wall:.3f} s{goal}"


def _wall(code: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    return time.perf_counter() - start
