"""How long a run will take, told before it starts and every few seconds, from measured costs.

Seconds of a job are those that jobs of its rule took in this run; before the first one, those of
the last run here or of the machine that the shipped costs were measured on, times how much slower
this run has been so far.
"""

import csv
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TextIO

from spinepipe.files import appearing

SHIPPED = Path("workflow") / "job_seconds.csv"
"""Seconds of one job by rule, measured by `snakemake -j2 all`; rule `(machine)` is `probe`."""

LAST_RUN = Path(".snakemake") / "job_seconds.csv"
"""The same of runs here; may be deleted at any time."""

MACHINE = "(machine)"
_UNKNOWN_S = 0.5
_TRIED_S = 2.0
"""What is expected of a rule counts as so many seconds of jobs: the first ones load modules."""
_SECONDS_BETWEEN_LINES = 2.0


def costs(root: Path) -> dict[str, float]:
    """Seconds of a job of each rule, of this machine where it has run them."""
    found: dict[str, float] = {}
    for path in (root / SHIPPED, root / LAST_RUN):
        if path.is_file():
            with path.open(encoding="utf-8", newline="") as file:
                found |= {row["rule"]: float(row["seconds"]) for row in csv.DictReader(file)}
    return found


def probe() -> float:
    """Seconds of a fixed piece of work, the best of three: how fast this machine is."""
    best = float("inf")
    for _ in range(3):
        begun = time.perf_counter()
        sum(number * number for number in range(200_000))
        best = min(best, time.perf_counter() - begun)
    return best


def duration(seconds: float) -> str:
    """Seconds as people say them: `34 s`, `12 min`, `3.5 h`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 6000:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


class TimeLeft:
    """Counts finished jobs and writes a line with the time that the whole run still takes.

    Parameters
    ----------
    totals
        Returns how many jobs of each rule the run needs, as far as is known by now.
    expected
        Seconds of a job by rule, see `costs`.
    cores
        How many jobs run at a time.
    stream
        Where the lines go; standard error unless told.
    clock
        Seconds, monotonic.
    """

    def __init__(
        self,
        totals: Callable[[], Mapping[str, int]],
        expected: Mapping[str, float],
        cores: int,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._totals = totals
        self._expected = expected
        self._cores = cores
        self._stream = stream or sys.stderr
        self._clock = clock
        self._lock = threading.Lock()
        self._done: Counter[str] = Counter()
        self._took: defaultdict[str, float] = defaultdict(float)
        self._printed_at = clock()
        self._slower = probe() / expected[MACHINE] if MACHINE in expected else 1.0

    def ahead(self) -> str:
        """What is to be made, and how long that takes."""
        totals = self._totals()
        return f"{sum(totals.values()):,} jobs, about {duration(self.seconds_left(totals))}"

    def finish(self, rule: str, seconds: float) -> None:
        """Count one finished job of this rule and print a line when one is due."""
        with self._lock:
            self._done[rule] += 1
            self._took[rule] += seconds
            now = self._clock()
            if now - self._printed_at >= _SECONDS_BETWEEN_LINES:
                self._printed_at = now
                print(self._line(rule), file=self._stream, flush=True)

    def _line(self, rule: str) -> str:
        try:
            totals = self._totals()
        except RuntimeError:  # Snakemake changed its table of jobs while we were counting
            totals = {}
        done = sum(self._done.values())
        line = f"{done:,} of {max(sum(totals.values()), done):,} jobs"
        return f"{line}  ·  {duration(self.seconds_left(totals))} left  ·  {rule}"

    def seconds_left(self, totals: Mapping[str, int]) -> float:
        """Wall time until the jobs of `totals` that are not finished are, s."""
        foreseen = _TRIED_S + sum(self._done[rule] * self._cost(rule) for rule in self._done)
        slower = (_TRIED_S * self._slower + sum(self._took.values())) / foreseen
        left = 0.0
        for rule, total in totals.items():
            left += max(0, total - self._done[rule]) * self._each(rule, slower)
        return left / self._cores

    def _each(self, rule: str, slower: float = 1.0) -> float:
        """Seconds of a job: what is expected, the more corrected the longer jobs have run."""
        jobs_expected = _TRIED_S / self._cost(rule)
        return (_TRIED_S * slower + self._took[rule]) / (jobs_expected + self._done[rule])

    def _cost(self, rule: str) -> float:
        return self._expected.get(rule, _UNKNOWN_S)

    def keep(self, root: Path) -> None:
        """Write down what jobs took, for the next run here."""
        took = {rule: self._each(rule) for rule in self._done}
        known = {**costs(root), **took, MACHINE: probe()}
        with (
            appearing(root / LAST_RUN) as temporary,
            temporary.open("w", encoding="utf-8", newline="") as file,
        ):
            csv.writer(file, lineterminator="\n").writerows(
                [("rule", "seconds"), *((rule, f"{known[rule]:.3g}") for rule in sorted(known))]
            )
