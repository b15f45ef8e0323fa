"""Markers as a file of motion has them, before anything is known of the person."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.problems import InputError, InputProblem

WITHOUT_SUBJECT = "names of markers without what stands before the colon"

M_PER = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Units in which motion is written."""


@dataclass(frozen=True, eq=False)
class MarkerRecording:
    """Markers over time.

    Attributes
    ----------
    names : (K,). time_s : (F,). places : (F, K, 3) m, zero where not seen. seen : (F, K).
    repaired : what was read otherwise than it stands in the file, one sentence each.
    first : number of the first frame that was kept, counted from 1 in the file.
    """

    names: tuple[str, ...]
    time_s: Array
    places: Array
    seen: NDArray[np.bool_]
    repaired: tuple[str, ...] = ()
    first: int = 1

    def __post_init__(self) -> None:
        for array in (self.time_s, self.places, self.seen):
            array.flags.writeable = False


def recording_from(
    names: tuple[str, ...], time_s: Array, raw: Array, repaired: tuple[str, ...] = ()
) -> MarkerRecording:
    """From raw places (F, K, 3) m, NaN or all zero where a marker is not seen."""
    seen = np.isfinite(raw).all(axis=-1) & (raw != 0.0).any(axis=-1)
    return MarkerRecording(names, time_s, np.where(seen[..., None], raw, 0.0), seen, repaired)


def unit_of(file: str, row: int | None, column: str, text: str) -> float:
    """What one unit of a file is in m.

    Raises
    ------
    InputError
        Where it is none of `M_PER`.
    """
    known = text.strip().lower()
    if known not in M_PER:
        allowed = ", ".join(M_PER)
        raise InputError([InputProblem(file, row, column, repr(text), allowed, "correct the unit")])
    return M_PER[known]


def without_subjects(names: tuple[str, ...], file: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names without their subject (`Anna:T1`) where that leaves each once, and what was done.

    What was done stands on pages, so it does not name the subject: people write names of persons.

    Raises
    ------
    InputError
        Of names that come twice.
    """
    again = [name for name, count in Counter(names).items() if count > 1]
    if again:
        found = f"{', '.join(again)} more than once"
        raise InputError(
            [InputProblem(file, None, None, found, "each marker once", "rename one of them")]
        )
    short = [name.rpartition(":")[2].strip() for name in names]
    counts = Counter(short)
    chosen = tuple(
        cut if cut and counts[cut] == 1 else name for name, cut in zip(names, short, strict=True)
    )
    return chosen, (WITHOUT_SUBJECT,) if chosen != names else ()
