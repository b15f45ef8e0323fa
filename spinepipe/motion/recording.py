"""Markers as a file of motion has them, before anything is known of the person."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.problems import InputError, InputProblem

WITHOUT_SUBJECT = "names of markers without what stands before the colon"

WITH_NUMBERS = "names that are empty or stand more than once have a number, as in T1#2"

UNNAMED, NUMBERED = "unnamed", "#"

MOST_RECORDING_BYTES = 128_000_000
"""Of a file of motion. 100 MB are read in less than 1 GB of memory."""

M_PER = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Units in which motion is written."""

WORDS = {"mill": "mm", "cent": "cm", "mete": "m", "metr": "m"}
"""Units by the first letters of their words, which some programs cut off: `mete`."""


@dataclass(frozen=True, eq=False)
class MarkerRecording:
    """Markers over time.

    Attributes
    ----------
    names : (K,). time_s : (F,). places : (F, K, 3) m, zero where not seen. seen : (F, K).
    repaired : what was read otherwise than it stands in the file, one sentence each.
    first : number of the first frame that was kept, counted from 1 in the file.
    repeated : names that stand more than once in the file; they have a number in `names`.
    """

    names: tuple[str, ...]
    time_s: Array
    places: Array
    seen: NDArray[np.bool_]
    repaired: tuple[str, ...] = ()
    first: int = 1
    repeated: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.time_s, self.places, self.seen):
            array.flags.writeable = False


def recording_from(
    names: tuple[str, ...], time_s: Array, raw: Array, repaired: tuple[str, ...] = ()
) -> MarkerRecording:
    """From raw places (F, K, 3) m, NaN or all zero where a marker is not seen; they are kept."""
    seen = np.isfinite(raw).all(axis=-1) & (raw != 0.0).any(axis=-1)
    raw[~seen] = 0.0
    return MarkerRecording(names, time_s, raw, seen, repaired)


def unit_of(file: str, row: int | None, column: str, text: str) -> float:
    """What one unit of a file is in m: one of `M_PER`, or its word.

    Raises
    ------
    InputError
        Where it is none.
    """
    known = WORDS.get(text.strip().lower()[:4], text.strip().lower())
    if known not in M_PER:
        allowed = ", ".join(M_PER)
        raise InputError([InputProblem(file, row, column, repr(text), allowed, "correct the unit")])
    return M_PER[known]


def without_subjects(names: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names without their subject (`Anna:T1`) where that leaves each once, and what was done.

    What was done stands on pages, so it does not name the subject: people write names of persons.
    """
    short = {name: name.rpartition(":")[2].strip() for name in names}
    counts = Counter(short.values())
    chosen = tuple(cut if (cut := short[name]) and counts[cut] == 1 else name for name in names)
    return chosen, (WITHOUT_SUBJECT,) if chosen != names else ()


def numbered(names: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names with a number behind those that stand more than once, and what was done."""
    counts, so_far = Counter(names), Counter[str]()
    found = []
    for name in names:
        if name and counts[name] == 1:
            found.append(name)
            continue
        so_far[name] += 1
        while (label := f"{name or UNNAMED}{NUMBERED}{so_far[name]}") in counts:
            so_far[name] += 1
        found.append(label)
    return tuple(found), (WITH_NUMBERS,) if tuple(found) != names else ()
