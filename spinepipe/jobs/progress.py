"""One short line every two seconds about a run with thousands of jobs."""

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import TextIO

_SECONDS_BETWEEN_LINES = 2.0


class Progress:
    """Counts finished jobs and writes a line with an estimate of the time left.

    Parameters
    ----------
    totals
        Returns how many jobs of each rule the run needs, as far as is known by now.
    stream
        Where the lines go.
    clock
        Seconds, monotonic.
    """

    def __init__(
        self,
        totals: Callable[[], Mapping[str, int]],
        stream: TextIO = sys.stderr,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._totals = totals
        self._stream = stream
        self._clock = clock
        self._lock = threading.Lock()
        self._done: Counter[str] = Counter()
        self._started: dict[str, float] = {}
        self._printed = clock()

    def start(self, rule: str) -> None:
        """Note that a job of this rule begins; the first one starts the rule's clock."""
        with self._lock:
            self._started.setdefault(rule, self._clock())

    def finish(self, rule: str) -> None:
        """Count one finished job of this rule and print a line when one is due."""
        with self._lock:
            self._done[rule] += 1
            now = self._clock()
            if now - self._printed >= _SECONDS_BETWEEN_LINES:
                self._printed = now
                print(self._line(rule, now), file=self._stream, flush=True)

    def _line(self, rule: str, now: float) -> str:
        totals = self._totals()
        done = self._done[rule]
        total = max(totals.get(rule, 0), done)
        left = (now - self._started.get(rule, now)) / done * (total - done)
        all_done = sum(self._done.values())
        everything = max(sum(totals.values()), all_done)
        return (
            f"{rule}  {done}/{total}  ·  {duration(left)} left"
            f"  ·  {all_done}/{everything} jobs in all"
        )


def duration(seconds: float) -> str:
    """Seconds as people say them: `34 s`, `12 min`, `3.5 h`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 6000:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
