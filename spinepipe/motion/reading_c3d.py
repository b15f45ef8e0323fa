"""Motion as `.c3d`: unit and rate are the file's own; a negative residual says: not seen.

Nothing that a file tells of its sizes is trusted: a parameter may claim gigabytes, a list may lead
back to its beginning. Libraries for this form end the process then, or fill the memory.

By The C3D File Format, User Guide (2008). The file has blocks of 512 bytes, counted from 1:

- block 1, the header: where parameters and frames begin, how many markers, frames a second;
- parameters, in named groups (POINT, TRIAL, ...). Entries stand one behind the other, each with the
  number of bytes to the next (its *way*). Some tell again what the header tells;
- frames: four numbers a marker (x, y, z, residual), then the analog channels. All are 32-bit reals,
  or all 16-bit whole numbers, of which x, y, z are to be multiplied by the *scale*.

`at`, `start` and `behind` are places in the file in bytes from 0.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spinepipe.motion.recording import MarkerRecording, recording_from, unit_of
from spinepipe.problems import InputError, InputProblem

BLOCK = 512
"""Bytes."""

MAGIC = 0x50
"""Second byte of every such file."""

MOST_DIMENSIONS = 7
"""Of the array of a parameter, by the form."""

INTEL, DEC, MIPS = 84, 85, 86
"""By which processor numbers were written: Intel (low byte first), DEC (low byte first, reals of
its own) or MIPS (high byte first)."""

CHARACTERS, BYTE, WORD, REAL = -1, 1, 2, 4
"""Types of parameters; without their sign, the bytes of one element."""

Value = tuple[str, ...] | tuple[float, ...]
"""Elements of a parameter's array in the order of the file."""

Parameters = Mapping[tuple[str, str], Value]
"""Value by group and name, both in capitals: (POINT, RATE)."""

SLOWEST, FASTEST = 1.0, 100_000.0
"""Frames a second that are taken for possible."""

COUNT_ENDS = 65_535
"""Largest number of 16 bits. Longer recordings have it as number of frames, which tells nothing."""

MORE_LABELS = ("LABELS", *(f"LABELS{k}" for k in range(2, 10)))
"""A parameter holds 255 names; further ones follow in the next."""

AGAIN = "export the motion again"


class FormError(ValueError):
    """A file that does not hold together; the text says what was found."""


@dataclass(frozen=True)
class C3dFile:
    """Header and parameters of a file, and all its bytes.

    Attributes
    ----------
    data : all bytes. processor : see `INTEL`. parameters : see `Parameters`.
    behind : where the list of parameters ends, see `_parameters`; no frame begins before it.
    points, analog : in a frame, how many markers, and how many numbers of analog channels (samples
        of all channels).
    first, last : of the first and the last frame, its number in the recording, from 1; by the
        header. start : where frames begin.
    header_scale : what whole numbers are multiplied by to be in POINT:UNITS; negative: frames are
        reals. header_rate : frames a second. Both are used where POINT does not tell them.
    """

    data: bytes
    processor: int
    parameters: Parameters
    behind: int
    points: int
    analog: int
    first: int
    last: int
    start: int
    header_scale: float
    header_rate: float

    def texts(self, name: str) -> list[str]:
        """Texts of a parameter of POINT; none where there is none, or it has numbers."""
        return [one for one in self.parameters.get(("POINT", name), ()) if isinstance(one, str)]

    def numbers(self, group: str, name: str) -> list[float]:
        """Numbers of a parameter; none where there is none, or it has texts."""
        return [one for one in self.parameters.get((group, name), ()) if not isinstance(one, str)]

    def number(self, name: str) -> float | None:
        """The first number of a parameter of POINT; None where there is none."""
        return next(iter(self.numbers("POINT", name)), None)

    @property
    def rate(self) -> float:
        """Frames a second; the header's where POINT tells none or 0."""
        return self.number("RATE") or self.header_rate

    @property
    def scale(self) -> float:
        """As `header_scale`; the header's where POINT tells none or 0."""
        return self.number("SCALE") or self.header_scale

    @property
    def labels(self) -> list[str]:
        """Names of markers."""
        return [name for key in MORE_LABELS for name in self.texts(key)]

    @property
    def frames_told(self) -> set[int]:
        """How many frames the file tells: by TRIAL alone, else by header and POINT.

        One number where they agree, two where they do not, none where neither tells it: a count of
        `COUNT_ENDS` is a full counter and tells nothing.
        """
        # TRIAL has two 16-bit words for each end, the lower first: enough for any recording
        ends = (self.numbers("TRIAL", f"ACTUAL_{end}_FIELD") for end in ("START", "END"))
        of_trial = [words[0] + 65_536.0 * words[1] for words in ends if len(words) == 2]
        if len(of_trial) == 2:
            return {int(of_trial[1] - of_trial[0] + 1)}
        told = list[float]()
        if self.last < COUNT_ENDS:
            told.append(self.last - self.first + 1)
        if (frames := self.number("FRAMES")) is not None and np.isfinite(frames):
            told.append(frames)
        return {int(one) for one in told if 0 < one < COUNT_ENDS or one > COUNT_ENDS}

    @property
    def room(self) -> int:
        """Frames for which there are bytes; 0 where they would begin within the parameters."""
        if self.start < self.behind or not self.points:
            return 0
        bytes_of_frame = (4 if self.scale < 0.0 else 2) * (4 * self.points + self.analog)
        return (len(self.data) - self.start) // bytes_of_frame

    @property
    def frames(self) -> int:
        """Number of frames, as told; where nothing tells it, as many as there is room for.

        Of two numbers that contradict each other it is one of them: `read_c3d` refuses such files.
        """
        return next(iter(self.frames_told), self.room)


def read_c3d(path: Path, file: str) -> MarkerRecording:
    """Markers of a `.c3d`, in m, on the axes of the file.

    Time is 0 at frame 1 of the recording: a file that was cropped begins later, at its first frame.

    Parameters
    ----------
    path : of the file. file : its name in messages.

    Raises
    ------
    InputError
        Where it cannot be read, tells neither unit nor rate, or contradicts itself.
    """
    try:
        whole = parse_c3d(path.read_bytes())
    except FormError as error:
        raise InputError([InputProblem(file, None, None, str(error), "a .c3d", AGAIN)]) from error
    problems = list(_contradictions(whole, file))
    if problems:
        raise InputError(problems)
    unit_m = unit_of(file, None, "POINT:UNITS", next(iter(whole.texts("UNITS")), ""))
    # four numbers a marker: its place and a residual; then analog channels, which are left out
    in_frame, scale = 4 * whole.points + whole.analog, whole.scale
    number = whole.frames * in_frame
    if scale < 0.0:
        cells = reals(whole.data, whole.start, number, whole.processor)
    else:
        # with a sign: from 2^15 on they stand for negative numbers (two's complement)
        unsigned = words(whole.data, whole.start, number, whole.processor)
        cells = np.where(unsigned < 1 << 15, unsigned, unsigned - (1 << 16)).astype(np.float64)
    rows = cells.reshape(whole.frames, in_frame)[:, : 4 * whole.points]
    points = rows.reshape(whole.frames, -1, 4)
    raw, residuals = points[..., :3] * (1.0 if scale < 0.0 else scale), points[..., 3]
    places = np.where((residuals < 0.0)[..., None], np.nan, unit_m * raw)
    time_s = (max(whole.first - 1, 0) + np.arange(len(raw))) / whole.rate
    return recording_from(tuple(whole.labels[: whole.points]), time_s, places)


def _contradictions(whole: C3dFile, file: str) -> Iterator[InputProblem]:
    """What the file tells that cannot be, or that header and parameters tell differently."""

    def problem(place: str, found: str, allowed: str) -> InputProblem:
        return InputProblem(file, None, place, found, allowed, AGAIN)

    if not SLOWEST <= whole.rate <= FASTEST:
        allowed = f"{SLOWEST:g} to {FASTEST:g} frames a second"
        yield problem("POINT:RATE", f"{whole.rate:g} frames a second", allowed)
    if not np.isfinite(whole.scale) or whole.scale == 0.0:
        found, allowed = f"a scale of {whole.scale:g}", "a finite number that is not zero"
        yield problem("POINT:SCALE", found, allowed)
    used = whole.number("USED")
    if not whole.points or (used is not None and used != whole.points):
        told = "" if used is None else f", {used:g} in its parameters"
        found = f"{whole.points} markers in the header{told}"
        yield problem("POINT:USED", found, "at least one, the same twice")
    elif len(whole.labels) < whole.points:
        found = f"{len(whole.labels)} names of {whole.points} markers"
        yield problem("POINT:LABELS", found, "a name for each")
    frames = whole.frames_told
    if len(frames) > 1:
        found = f"{' frames and '.join(map(str, sorted(frames)))} frames"
        yield problem("POINT:FRAMES", found, "the same in header and parameters")
    elif whole.first > whole.last:
        found = f"frames from {whole.first} to {whole.last}"
        yield problem("POINT:FRAMES", found, "a first frame before the last")
    elif not whole.frames or whole.frames > whole.room:
        told = f" of {next(iter(frames))}" if frames else ""
        found = f"room for {max(whole.room, 0)}{told} frames"
        yield problem("POINT:FRAMES", found, "all that are told; the file may be cut off")


def parse_c3d(data: bytes) -> C3dFile:
    """Header and parameters of a file.

    Raises
    ------
    FormError
        Where it does not hold together.
    """
    # bytes 0 and 1 of the header: first block of the parameters, and what marks the form
    if len(data) < 2 * BLOCK or data[1] != MAGIC or data[0] < 2:
        raise FormError("no header of a .c3d")
    start = (data[0] - 1) * BLOCK
    if len(data) < start + 4:
        raise FormError("a file that ends before its parameters")
    # parameters: two bytes that tell nothing, how many blocks, the processor; then the entries
    processor = data[start + 3]
    if processor not in (INTEL, DEC, MIPS):
        raise FormError(f"numbers of a processor {processor}")
    parameters, behind = _parameters(data, start + 4, processor)
    # the header, by bytes: four 16-bit words from 2, the scale at 12, first block of frames at 16,
    # the rate at 20
    points, analog, first, last = words(data, 2, 4, processor).tolist()
    (scale,), (rate,) = reals(data, 12, 1, processor), reals(data, 20, 1, processor)
    (block,) = words(data, 16, 1, processor).tolist()
    start = (block - 1) * BLOCK
    return C3dFile(
        *(data, processor, parameters, behind, points, analog, first, last),
        start,
        float(scale),
        float(rate),
    )


def words(data: bytes, at: int, number: int, processor: int) -> NDArray[np.int64]:
    """(number,) 16-bit numbers without a sign, from byte ``at`` on."""
    form = ">u2" if processor == MIPS else "<u2"
    return np.frombuffer(data, form, number, at).astype(np.int64)


def reals(data: bytes, at: int, number: int, processor: int) -> NDArray[np.float64]:
    """(number,) 32-bit reals, from byte ``at`` on.

    A DEC writes the two 16-bit halves in the other order, and the same bits, read as IEEE's, are
    four times its number.
    """
    if processor != DEC:
        form = ">f4" if processor == MIPS else "<f4"
        return np.frombuffer(data, form, number, at).astype(np.float64)
    halves = np.frombuffer(data, "<u2", 2 * number, at).reshape(-1, 2)
    return np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel().astype(np.float64) / 4.0


def _parameters(data: bytes, at: int, processor: int) -> tuple[Parameters, int]:
    """All parameters, and where the list ends: its last entry, or the empty one behind that.

    An entry: length of its name, number of its group, name, way to the next entry, and of a
    parameter its value. Entries with a negative group number are the groups themselves.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Value]] = []
    while at + 2 <= len(data):
        length, group = struct.unpack_from("<bb", data, at)  # length: negative if it is locked
        way_at = at + 2 + abs(length)
        if not length:
            break
        if way_at + 2 > len(data):
            raise FormError("a file that ends within its parameters")
        name = data[at + 2 : way_at].decode("ascii", "replace").upper()
        (way,) = struct.unpack_from(">h" if processor == MIPS else "<h", data, way_at)
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(data, way_at + 2, name, processor)))
        # counted from the way itself, which has 2 bytes; 0 at the last entry. Never backwards
        if way < 0 or (0 < way < 2):
            raise FormError(f"a parameter {name!a} that leads nowhere")
        if not way:
            break
        at = way_at + way
    else:
        raise FormError("parameters that have no end")
    return {(groups.get(group, ""), name): value for group, name, value in found}, at


def _value(data: bytes, at: int, name: str, processor: int) -> Value:
    """The array of a parameter, flat, its first index changing fastest.

    At ``at``: type, how many sizes, the sizes, the elements. Of characters the first size is the
    length of each text, and texts are the elements. Whole numbers are read without a sign.
    """
    if at + 2 > len(data):
        raise FormError("a file that ends within its parameters")
    kind, dimensions = struct.unpack_from("<bB", data, at)
    sizes = list(data[at + 2 : at + 2 + dimensions])
    begin, size = at + 2 + dimensions, abs(kind) * prod(sizes)
    if dimensions > MOST_DIMENSIONS or len(sizes) < dimensions or begin + size > len(data):
        raise FormError(f"a parameter {name!a} of {size} bytes, which are not there")
    if kind == CHARACTERS:
        letters = data[begin : begin + size]
        longest = sizes[0] if sizes else size
        number = prod(sizes[1:]) if longest else 0
        pieces = (letters[k * longest : (k + 1) * longest] for k in range(number))
        return tuple(piece.decode("utf-8", "replace").strip(" \0") for piece in pieces)
    if kind == BYTE:
        return tuple(map(float, data[begin : begin + size]))
    if kind == WORD:
        return tuple(map(float, words(data, begin, prod(sizes), processor)))
    if kind == REAL:
        return tuple(map(float, reals(data, begin, prod(sizes), processor)))
    raise FormError(f"a parameter {name!a} of type {kind}")
