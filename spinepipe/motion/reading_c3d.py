"""Motion as `.c3d`: units and rate of its own; a negative residual says: not seen."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.c3d_form import BLOCK, FormError, Parts, reals, taken_apart, words
from spinepipe.motion.recorded import Recorded, recorded, unit_of
from spinepipe.problems import InputError, InputProblem

SLOWEST, FASTEST = 1.0, 100_000.0
"""Frames a second."""

COUNT_ENDS = 65_535
"""Numbers of frames have 16 bits; of longer recordings header and parameters may tell no more."""

MORE_LABELS = ("LABELS", *(f"LABELS{k}" for k in range(2, 10)))
"""A parameter holds 255 names; further ones follow in the next."""

AGAIN = "export the motion again"


def read_c3d(path: Path, file: str) -> Recorded:
    """Markers of a `.c3d`, in the axes of the file; its first frame tells when it begins.

    Parameters
    ----------
    file : its name in messages.

    Raises
    ------
    InputError
        Where it cannot be read, tells neither unit nor rate, or contradicts itself.
    """
    try:
        parts = taken_apart(path.read_bytes())
    except FormError as error:
        raise InputError([InputProblem(file, None, None, str(error), "a .c3d", AGAIN)]) from error
    problems = list(_contradictions(parts, file))
    if problems:
        raise InputError(problems)
    scale = unit_of(file, None, "POINT:UNITS", next(iter(_texts(parts, "UNITS")), ""))
    raw, residuals = _frames(parts, _number_of_frames(parts))
    places = np.where((residuals < 0.0)[..., None], np.nan, scale * raw)
    time_s = (max(parts.header.first - 1, 0) + np.arange(len(raw))) / _rate(parts)
    return recorded(tuple(_labels(parts)[: raw.shape[1]]), time_s, places)


def _texts(parts: Parts, name: str) -> list[str]:
    """Texts of a parameter of POINT."""
    return [one for one in parts.parameters.get(("POINT", name), ()) if isinstance(one, str)]


def _numbers(parts: Parts, group: str, name: str) -> list[float]:
    """Numbers of a parameter."""
    return [one for one in parts.parameters.get((group, name), ()) if not isinstance(one, str)]


def _number(parts: Parts, name: str) -> float | None:
    """The first number of a parameter of POINT; None where there is none."""
    return next(iter(_numbers(parts, "POINT", name)), None)


def _rate(parts: Parts) -> float:
    return _number(parts, "RATE") or parts.header.rate


def _scale(parts: Parts) -> float:
    return _number(parts, "SCALE") or parts.header.scale


def _labels(parts: Parts) -> list[str]:
    return [name for key in MORE_LABELS for name in _texts(parts, key)]


def _contradictions(parts: Parts, file: str) -> Iterator[InputProblem]:
    """What the file tells that cannot be, or that its other half tells otherwise."""
    header, rate, scale = parts.header, _rate(parts), _scale(parts)

    def problem(place: str, found: str, allowed: str) -> InputProblem:
        return InputProblem(file, None, place, found, allowed, AGAIN)

    if not SLOWEST <= rate <= FASTEST:
        allowed = f"{SLOWEST:g} to {FASTEST:g} frames a second"
        yield problem("POINT:RATE", f"{rate:g} frames a second", allowed)
    if not np.isfinite(scale) or scale == 0.0:
        yield problem("POINT:SCALE", f"a scale of {scale:g}", "a finite number that is not zero")
    used = _number(parts, "USED")
    if not header.points or (used is not None and used != header.points):
        told = "" if used is None else f", {used:g} in its parameters"
        found = f"{header.points} markers in the header{told}"
        yield problem("POINT:USED", found, "at least one, the same twice")
    elif len(_labels(parts)) < header.points:
        found = f"{len(_labels(parts))} names of {header.points} markers"
        yield problem("POINT:LABELS", found, "a name for each")
    frames = _frames_told(parts)
    if len(frames) > 1:
        found = f"{' frames and '.join(map(str, sorted(frames)))} frames"
        yield problem("POINT:FRAMES", found, "the same in header and parameters")
    elif header.first > header.last:
        found = f"frames from {header.first} to {header.last}"
        yield problem("POINT:FRAMES", found, "a first frame before the last")
    elif not _number_of_frames(parts) or _number_of_frames(parts) > _room(parts):
        told = f" of {next(iter(frames))}" if frames else ""
        found = f"room for {max(_room(parts), 0)}{told} frames"
        yield problem("POINT:FRAMES", found, "all that are told; the file may be cut off")


def _frames_told(parts: Parts) -> set[int]:
    """How many frames header, POINT and TRIAL tell; counts that are full tell nothing."""
    header, told = parts.header, list[float]()
    ends = (_numbers(parts, "TRIAL", f"ACTUAL_{end}_FIELD") for end in ("START", "END"))
    of_trial = [words[0] + 65_536.0 * words[1] for words in ends if len(words) == 2]
    if len(of_trial) == 2:
        return {int(of_trial[1] - of_trial[0] + 1)}
    if header.last < COUNT_ENDS:
        told.append(header.last - header.first + 1)
    if (frames := _number(parts, "FRAMES")) is not None and np.isfinite(frames):
        told.append(frames)
    return {int(one) for one in told if 0 < one < COUNT_ENDS or one > COUNT_ENDS}


def _number_of_frames(parts: Parts) -> int:
    """As told; where nothing tells it, as many as are there."""
    return next(iter(_frames_told(parts)), _room(parts))


def _bytes_of_frame(parts: Parts) -> int:
    each = 4 if _scale(parts) < 0.0 else 2
    return each * (4 * parts.header.points + parts.header.analog)


def _room(parts: Parts) -> int:
    """Frames that are in the file; none where they would begin within the parameters."""
    start = (parts.header.data_block - 1) * BLOCK
    if start < parts.behind or not parts.header.points:
        return 0
    return (len(parts.data) - start) // _bytes_of_frame(parts)


def _frames(parts: Parts, number: int) -> tuple[Array, Array]:
    """(F, K, 3) places in units of the file, and (F, K) residuals."""
    header, scale = parts.header, _scale(parts)
    start, in_frame = (header.data_block - 1) * BLOCK, 4 * header.points + header.analog
    if scale < 0.0:
        cells = reals(parts.data, start, number * in_frame, parts.processor)
    else:
        whole = words(parts.data, start, number * in_frame, parts.processor)
        cells = np.where(whole < 1 << 15, whole, whole - (1 << 16)).astype(np.float64)
    points = cells.reshape(number, in_frame)[:, : 4 * header.points].reshape(number, -1, 4)
    return points[..., :3] * (1.0 if scale < 0.0 else scale), points[..., 3]
