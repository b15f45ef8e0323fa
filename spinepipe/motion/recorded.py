"""Markers as a file of motion has them, before anything is known of the person."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spinepipe.documents.text import INVISIBLE
from spinepipe.effects.contract import Array
from spinepipe.problems import InputError, InputProblem

M_PER = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Units in which motion is written."""


@dataclass(frozen=True, eq=False)
class Recorded:
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
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False


def recorded(
    names: tuple[str, ...], time_s: Array, raw: Array, repaired: tuple[str, ...] = ()
) -> Recorded:
    """From raw places (F, K, 3) m, NaN or all zero where a marker is not seen."""
    seen = np.isfinite(raw).all(axis=-1) & (raw != 0.0).any(axis=-1)
    return Recorded(names, time_s, np.where(seen[..., None], raw, 0.0), seen, repaired)


MOST_CELLS = 10_000_000
"""Of a recording: six minutes of 80 markers at 100 frames a second."""


def text_of(path: Path, file: str) -> str:
    """Text of a recording; bytes that are no UTF-8, as in names of folders, are replaced.

    Raises
    ------
    InputError
        Where there is more than is read, said before it is taken apart; or nothing readable.
    """
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    hidden = INVISIBLE.search(text)
    if hidden is not None:
        found = f"the control character U+{ord(hidden[0]):04X}"
        line = text[: hidden.start()].count("\n") + 1
        raise InputError([InputProblem(file, line, None, found, "text", "export the motion again")])
    number = max(map(text.count, "\t, "))
    if number > MOST_CELLS:
        allowed, remedy = f"at most {MOST_CELLS} cells", "crop it, or leave markers or frames out"
        raise InputError([InputProblem(file, None, None, f"{number} cells", allowed, remedy)])
    return text


def quickly(cells: Sequence[str]) -> list[float] | None:
    """Cells as numbers; None where one is empty or none, which is to be looked at one by one."""
    try:
        numbers = list(map(float, cells))
    except ValueError:
        return None
    text = "".join(cells)
    return numbers if isfinite(sum(numbers)) and text.isascii() and "_" not in text else None


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
