"""Files of motion: `.trc`, `.c3d` and `.csv` with markers, turned into ground axes and cropped.

Units and frame rates are those that the file tells. Nothing is guessed: what is repaired is said,
what is doubtful is refused with its place.
"""

from collections.abc import Callable
from math import isnan, nan
from pathlib import Path

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.reading_c3d import read_c3d
from spinepipe.motion.reading_text import read_csv
from spinepipe.motion.reading_trc import read_trc
from spinepipe.motion.recording import (
    MOST_RECORDING_BYTES,
    MarkerRecording,
    numbered,
    without_subjects,
)
from spinepipe.problems import InputError, InputProblem

DEFAULT_AXES = "x y z"
"""Axes of a file that are those of ground: forwards, up, to the right."""

READERS: dict[str, Callable[[Path, str], MarkerRecording]] = {
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


def axes_of(text: str) -> Array:
    """(3, 3) of a text that tells what forwards, up and right are in the axes of the file.

    Ground axes are in rows, axes of the file in columns.

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
) -> MarkerRecording:
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
    if (size := path.stat().st_size) > MOST_RECORDING_BYTES:
        found, allowed = f"{size / 1e6:.0f} MB", f"at most {MOST_RECORDING_BYTES / 1e6:g} MB"
        raise InputError([InputProblem(name, None, None, found, allowed, "crop it")])
    raw = reader(path, name)
    # frames from start to end, of which either may be open
    start, end = (nan if time_s is None else time_s for time_s in (start_s, end_s))
    kept = ~((raw.time_s < start - ON_TIME_S) | (raw.time_s > end + ON_TIME_S))
    if not kept.any():
        ends = ("an end" if isnan(time_s) else f"{time_s:g} s" for time_s in (start, end))
        found = f"no frame from {' to '.join(ends)}"
        allowed = f"times from {raw.time_s[0]:g} to {raw.time_s[-1]:g} s"
        problem = InputProblem(name, None, None, found, allowed, "correct start_s and end_s")
        raise NoFrameError(problem, late=bool(start > raw.time_s[-1]))
    names, shortened = without_subjects(raw.names)
    unique, renamed = numbered(names)
    # nothing is copied of a recording that is kept whole: it may be half of the memory
    frames = slice(None) if kept.all() else kept
    return MarkerRecording(
        unique,
        raw.time_s[frames],
        raw.places[frames] @ turn.T,
        raw.seen[frames],
        (*raw.repaired, *shortened, *renamed),
        1 + int(np.argmax(kept)),
        tuple(dict.fromkeys(name for name in names if names.count(name) > 1)),
    )
