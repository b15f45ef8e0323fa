"""Files of motion: `.trc`, `.c3d` and `.csv` with markers, turned into ground axes and cropped.

Units and frame rates are those that the file tells. Nothing is guessed: what is repaired is said,
what is doubtful is refused with its place.
"""

from collections import Counter
from collections.abc import Callable
from math import isnan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spinepipe.documents.text import MOST_CSV_BYTES
from spinepipe.effects.contract import Array
from spinepipe.motion.reading_c3d import read_c3d
from spinepipe.motion.reading_csv import read_csv
from spinepipe.motion.reading_trc import read_trc
from spinepipe.motion.recorded import Recorded
from spinepipe.problems import InputError, InputProblem

DEFAULT_AXES = "x y z"
"""Axes of a file that are those of ground: forwards, up, to the right."""

READERS: dict[str, Callable[[Path, str], Recorded]] = {
    ".trc": read_trc,
    ".c3d": read_c3d,
    ".csv": read_csv,
}

ON_TIME_S = 1e-6
"""What times of frames are rounded by."""


class NoFrameError(InputError):
    """No frame lies from the start to the end that are asked for.

    Attributes
    ----------
    late : whether the start is behind the last frame; else the end is before the first, or both
        lie between two frames.
    """

    def __init__(self, problem: InputProblem, late: bool) -> None:
        super().__init__([problem])
        self.late = late


Axes = NDArray[np.float64]
"""(3, 3): ground axes in rows, axes of the file in columns."""


def axes_of(text: str) -> Axes:
    """(3, 3) of a text that tells what forwards, up and right are in the axes of the file.

    Raises
    ------
    ValueError
        Where it does not name each axis once, or makes a left hand of a right one.
    """
    words = text.split()
    letters = [word.lstrip("+-") for word in words]
    if sorted(letters) != ["x", "y", "z"] or any(len(word) > 2 for word in words):
        raise ValueError(f"'{text}' does not name x, y and z once each")
    found = np.zeros((3, 3))
    for row, (word, letter) in enumerate(zip(words, letters, strict=True)):
        found[row, "xyz".index(letter)] = -1.0 if word.startswith("-") else 1.0
    if np.linalg.det(found) < 0.0:
        raise ValueError(f"'{text}' makes left of right: one sign is wrong")
    return found


def read_motion(
    path: Path,
    axes: str = DEFAULT_AXES,
    start_s: float | None = None,
    end_s: float | None = None,
    file: str | None = None,
) -> Recorded:
    """Markers of a file in ground axes.

    Parameters
    ----------
    axes : what forwards, up and right are in the axes of the file: `x z -y` where z is up and y to
        the left. start_s, end_s : the frames that are kept, both ends included; None or NaN: all.
    file : its name in messages; None: that of the path.

    Raises
    ------
    InputError
        With the place of what cannot be read; `NoFrameError` where nothing is kept.
    ValueError
        Of axes that are none.
    """
    turn = axes_of(axes)
    name = file or path.name
    reader = READERS.get(path.suffix.lower())
    if reader is None or not path.is_file():
        found = "no such file" if reader else f"a file '{path.suffix}'"
        allowed = f"a file of motion: {', '.join(READERS)}"
        raise InputError([InputProblem(name, None, None, found, allowed, "correct the name")])
    if (size := path.stat().st_size) > MOST_CSV_BYTES:
        found, allowed = f"{size / 1e6:.0f} MB", f"at most {MOST_CSV_BYTES / 1e6:g} MB"
        raise InputError([InputProblem(name, None, None, found, allowed, "crop it")])
    raw = reader(path, name)
    kept = _kept(raw.time_s, start_s, end_s)
    if not kept.any():
        found = f"no frame from {_told(start_s)} to {_told(end_s)}"
        allowed = f"times from {raw.time_s[0]:g} to {raw.time_s[-1]:g} s"
        problem = InputProblem(name, None, None, found, allowed, "correct start_s and end_s")
        raise NoFrameError(problem, late=start_s is not None and start_s > raw.time_s[-1])
    names, renamed = _names(raw.names, name)
    return Recorded(
        names,
        raw.time_s[kept],
        raw.places[kept] @ turn.T,
        raw.seen[kept],
        (*raw.repaired, *renamed),
        1 + int(np.argmax(kept)),
    )


def _told(time_s: float | None) -> str:
    return "an end" if time_s is None or isnan(time_s) else f"{time_s:g} s"


def _kept(time_s: Array, start_s: float | None, end_s: float | None) -> NDArray[np.bool_]:
    kept = np.ones(len(time_s), dtype=bool)
    if start_s is not None and not isnan(start_s):
        kept &= time_s >= start_s - ON_TIME_S
    if end_s is not None and not isnan(end_s):
        kept &= time_s <= end_s + ON_TIME_S
    return kept


def _names(names: tuple[str, ...], file: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names without their subject where that leaves each once, and what was done.

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
    subjects = sorted(
        {name.rpartition(":")[0] for name, cut in zip(names, chosen, strict=True) if name != cut}
    )
    return chosen, tuple(f"names of markers without '{subject}:'" for subject in subjects)
