"""How long the jobs of a run take, from measured seconds.

Seconds of a job are those that jobs of its rule took in this run; before the first one, those of
the last run here or of the machine that the shipped seconds were measured on, times how much slower
this run has been so far.
"""

import csv
import os
import time
from collections import Counter, defaultdict
from collections.abc import Mapping
from pathlib import Path

SHIPPED = Path("workflow") / "job_seconds.csv"
"""Seconds of one job by rule, measured by `snakemake -j2 all`; rule `(machine)` is `probe`."""

LAST_RUN = Path(".snakemake") / "job_seconds.csv"
"""The same of runs here; may be deleted at any time."""

MACHINE = "(machine)"
_UNKNOWN_S = 0.5
_TRIED_S = 2.0
"""What is expected of a rule counts as so many seconds of jobs: the first ones load modules."""


def job_seconds(root: Path) -> dict[str, float]:
    """Seconds of a job of each rule, and of `study:rule` where this machine has run it.

    Before this machine has run a rule, seconds of another one.
    """
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
    """Counts finished jobs and tells the time that others still take.

    Parameters
    ----------
    expected
        Seconds of a job by rule, see `job_seconds`.
    """

    def __init__(self, expected: Mapping[str, float]) -> None:
        self._expected = expected
        self._done: Counter[str] = Counter()
        self._took: defaultdict[str, float] = defaultdict(float)
        self._of_study: defaultdict[str, list[float]] = defaultdict(list)
        self._slower = probe() / expected[MACHINE] if MACHINE in expected else 1.0

    def finish(self, rule: str, seconds: float, study: str = "") -> None:
        """Count one finished job of this rule; another study's may take much longer."""
        if study:
            self._of_study[f"{study}:{rule}"].append(seconds)
        self._done[rule] += 1
        self._took[rule] += seconds

    def seconds(self, totals: Mapping[str, int], cores: int) -> float:
        """Wall time until the jobs of `totals`, by rule, that are not finished are, s."""
        foreseen = _TRIED_S + sum(self._done[rule] * self._cost(rule) for rule in self._done)
        slower = (_TRIED_S * self._slower + sum(self._took.values())) / foreseen
        left = {rule: max(0, total - self._done[rule]) for rule, total in totals.items()}
        return sum(count * self._each(rule, slower) for rule, count in left.items()) / cores

    def _each(self, rule: str, slower: float = 1.0) -> float:
        """Seconds of a job: what is expected, the more corrected the longer jobs have run."""
        jobs_expected = _TRIED_S / self._cost(rule)
        return (_TRIED_S * slower + self._took[rule]) / (jobs_expected + self._done[rule])

    def _cost(self, rule: str) -> float:
        return self._expected.get(rule, _UNKNOWN_S)

    def keep(self, root: Path) -> None:
        """Write down what jobs took, for the next run here."""
        took = {rule: self._each(rule) for rule in self._done}
        own = {key: sum(each) / len(each) for key, each in self._of_study.items()}
        known = {**job_seconds(root), **took, **own, MACHINE: probe()}
        temporary = root / f"{LAST_RUN}.{os.getpid()}"
        with temporary.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(
                [("rule", "seconds"), *((rule, f"{known[rule]:.3g}") for rule in sorted(known))]
            )
        temporary.replace(root / LAST_RUN)
