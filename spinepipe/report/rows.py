"""Which rows a panel has: a specimen, a joint, or a joint of a specimen, cranial on top."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

MOST_ROWS = 40
"""More rows than this on one page cannot be read: then specimens are pooled."""

MOST_ROWS_WITH_NUMBERS = 8
EVERY_JOINT = "*"


@dataclass(frozen=True)
class Rows:
    """Rows of a panel from the bottom up; ``note`` says what was pooled, or nothing."""

    labels: tuple[str, ...]
    frames: tuple[pd.DataFrame, ...]
    note: str

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.labels)

    @property
    def with_numbers(self) -> bool:
        """Whether there is room to write numbers beside each row."""
        return len(self) <= MOST_ROWS_WITH_NUMBERS


def rows_of(frame: pd.DataFrame, specimens: Sequence[str], joints: Sequence[str]) -> Rows:
    """Split rows with columns ``specimen`` and ``joint``; combinations without rows are left out.

    Parameters
    ----------
    specimens : in the order in which they are read, from the top.
    joints : caudal to cranial, or ``("*",)`` where all joints share a row.
    """
    keys = [(joint, specimen) for joint in joints for specimen in reversed(specimens)]
    pooled = len(keys) > MOST_ROWS and len(specimens) > 1
    if pooled:
        keys = [(joint, EVERY_JOINT) for joint in joints]
    found = [(key, _part(frame, *key)) for key in keys]
    kept = [(key, part) for key, part in found if len(part)]
    labels = tuple(_label(joint, specimen, len(specimens)) for (joint, specimen), _ in kept)
    note = f"{len(specimens)} specimens pooled" if pooled else ""
    return Rows(labels, tuple(part for _, part in kept), note)


def _part(frame: pd.DataFrame, joint: str, specimen: str) -> pd.DataFrame:
    chosen = frame["joint"] == joint
    if specimen != EVERY_JOINT:
        chosen &= frame["specimen"] == specimen
    return frame[chosen]


def _label(joint: str, specimen: str, n_specimens: int) -> str:
    if joint == EVERY_JOINT:
        return "all specimens" if specimen == EVERY_JOINT else specimen
    if specimen == EVERY_JOINT or n_specimens == 1:
        return joint
    return f"{specimen}  {joint}"
