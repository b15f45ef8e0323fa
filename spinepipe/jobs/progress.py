"""One short line every two seconds about a run with thousands of jobs."""

import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from typing import TextIO

_SECONDS_BETWEEN_LINES = 2.0
_JOBS_IN_RATE = 400


class Progress:
    """Counts finished jobs and writes a line with an estimate of the time left.

    The estimate is the pace of a rule's latest few hundred jobs, applied to those of the rule
    that are left: jobs of other rules may take ten times as long or as short.

    Parameters
    ----------
    totals
        Returns how many jobs of each rule the run needs, as far as is known by now.
    stream
        Where the lines go; standard error unless told.
    clock
        Seconds, monotonic.
    """

    def __init__(
        self,
        totals: Callable[[], Mapping[str, int]],
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._totals = totals
        self._stream = stream or sys.stderr
        self._clock = clock
        self._lock = threading.Lock()
        self._done: Counter[str] = Counter()
        self._finished_at: dict[str, deque[float]] = {}
        self._printed_at = clock()

    def finish(self, rule: str) -> None:
        """Count one finished job of this rule and print a line when one is due."""
        with self._lock:
            self._done[rule] += 1
            now = self._clock()
            times = self._finished_at.setdefault(rule, deque(maxlen=_JOBS_IN_RATE))
            times.append(now)
            if now - self._printed_at >= _SECONDS_BETWEEN_LINES:
                self._printed_at = now
                print(self._line(rule), file=self._stream, flush=True)

    def _line(self, rule: str) -> str:
        try:
            totals = self._totals()
        except RuntimeError:  # Snakemake changed its table of jobs while we were counting
            totals = {}
        done, all_done = self._done[rule], sum(self._done.values())
        total = max(totals.get(rule, 0), done)
        everything = max(sum(totals.values()), all_done)
        line = f"{rule}  {done}/{total}"
        times = self._finished_at[rule]
        if len(times) > 1 and totals:
            pace = (times[-1] - times[0]) / (len(times) - 1)
            line += f"  ·  {duration(pace * (total - done))} left of these"
        return f"{line}  ·  {all_done}/{everything} jobs in all"


def duration(seconds: float) -> str:
    """Seconds as people say them: `34 s`, `12 min`, `3.5 h`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 6000:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
