"""Score the targets that have no row yet, in worker processes; ends clean when told to end."""

import signal
import sys
import time
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path
from types import FrameType
from typing import Any

from tests.validation.discrepancy.row import Row, scored
from tests.validation.discrepancy.store import keep, path_of
from tests.validation.discrepancy.targets import Target

MOST_SECONDS = 240
"""Of processor time: a busy machine makes no search fail."""
TOLD_EVERY = 10

Task = tuple[Target, Path]


class TooLongError(RuntimeError):
    """A search that does not end."""


def run(targets: Sequence[Target], place: Path, jobs: int) -> None:
    """Rows of all targets, each in its file."""
    place.mkdir(parents=True, exist_ok=True)
    open_ones = [(t, path_of(t, place)) for t in targets if not path_of(t, place).exists()]
    said = f"{len(targets)} cohorts, {len(open_ones)} to score by code {place.name}"
    print(f"discrepancy: {said}", flush=True)
    if not open_ones:
        return
    before = signal.signal(signal.SIGTERM, _end)
    try:
        with get_context("spawn").Pool(min(jobs, len(open_ones)), _begin) as workers:
            _follow(workers.imap_unordered(keep_one, open_ones), len(open_ones))
    finally:
        signal.signal(signal.SIGTERM, before)


def _follow(answers: Any, number: int) -> None:
    """Tell how far the work is."""
    started = time.monotonic()
    for done, (target, row) in enumerate(answers, 1):
        if done == 1 or done % TOLD_EVERY == 0 or row["status"] != "scored":
            left = (time.monotonic() - started) / done * (number - done) / 60.0
            said = row.get("verdict", row["status"])
            names = "+".join(row.get("named", [])) or row["message"]
            print(
                f"discrepancy: {done} of {number}, {left:.0f} min left; last: {target.kind} "
                f"{target.label}, seed {target.seed}: {said} {names}",
                flush=True,
            )


def _begin() -> None:
    """A worker ends by its parent's word alone, and leaves no folder behind."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGPROF, _too_long)


def _end(number: int, frame: FrameType | None) -> None:
    sys.exit(128 + number)


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TooLongError


def keep_one(task: Task) -> tuple[Target, Row]:
    """Score a target and keep its row; in the process it is called in."""
    target, path = task
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        row = scored(target.recipe)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    row |= {"target": {"kind": target.kind, "label": target.label, "seed": target.seed}}
    row["target"]["gap"] = target.recipe.gap
    keep(row, path)
    return target, row
