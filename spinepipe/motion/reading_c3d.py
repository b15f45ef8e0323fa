"""Motion as `.c3d`: unit and rate are the file's own; a negative residual says: not seen.

Force plates and analog channels of the same files: `reading_plates`.

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
from functools import cached_property
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

MOST_PARAMETERS = 10
"""A parameter holds 255 elements; further ones follow in the next: LABELS, LABELS2, LABELS3 ..."""

BELIEVED_SCALE = "header and POINT:SCALE differ in sign; the file's size fits {}"
BELIEVED_ANALOG = "header and ANALOG:USED differ; the file's size fits ANALOG:USED"
BELIEVED_FRAMES = "header and POINT:FRAMES differ by one frame; the file has room for {} frames"

AGAIN = "export the motion again"


class FormError(ValueError):
    """A file that does not hold together; the text says what was found."""


@dataclass(frozen=True)
class C3dFile:
    """Header and parameters of a file, and all its bytes.

    Attributes
    ----------
    data : all bytes. processor : see `INTEL`. parameters : see `Parameters`. sizes : of the array
        of each, the fastest first.
    behind : where the list of parameters ends, see `_parameters`; no frame begins before it.
    points, header_analog : in a frame, how many markers, and how many numbers of analog channels
        (samples of all channels). samples : of each channel in a frame.
    first, last : of the first and the last frame, its number in the recording, from 1; by the
        header. start : where frames begin.
    header_scale : what whole numbers are multiplied by to be in POINT:UNITS; negative: frames are
        reals. header_rate : frames a second. Both are used where POINT does not tell them.
    """

    data: bytes
    processor: int
    parameters: Parameters
    sizes: Mapping[tuple[str, str], tuple[int, ...]]
    behind: int
    points: int
    header_analog: int
    samples: int
    first: int
    last: int
    start: int
    header_scale: float
    header_rate: float

    def values(self, group: str, name: str) -> Value:
        """Elements of a parameter and of those that go on with it; none where there is none."""
        further = (f"{name}{k}" for k in range(2, MOST_PARAMETERS))
        keys = [key for one in (name, *further) if (key := (group, one)) in self.parameters]
        return tuple(one for key in keys for one in self.parameters[key])  # type: ignore[return-value]

    def texts(self, group: str, name: str) -> list[str]:
        """Texts of a parameter; none where there is none, or it has numbers."""
        return [one for one in self.values(group, name) if isinstance(one, str)]

    def numbers(self, group: str, name: str) -> list[float]:
        """Numbers of a parameter; none where there is none, or it has texts."""
        return [one for one in self.values(group, name) if not isinstance(one, str)]

    def number(self, name: str) -> float | None:
        """The first number of a parameter of POINT; None where there is none."""
        return next(iter(self.numbers("POINT", name)), None)

    @property
    def rate(self) -> float:
        """Frames a second; the header's where POINT tells none or 0."""
        return self.number("RATE") or self.header_rate

    @cached_property
    def scale(self) -> float:
        """As `header_scale`; the header's where POINT tells none or 0.

        Where the two differ in sign, the one with which the frames that are told fill the file up
        to less than a block; NaN where none or both do.
        """
        told = self.number("SCALE") or self.header_scale
        if not -np.inf < told * self.header_scale < 0.0:
            return told
        both = (told, self.header_scale)
        fits = [scale for scale in both if self._fills(self.bytes_of_frame(scale))]
        return fits[0] if len(fits) == 1 else np.nan

    @cached_property
    def analog(self) -> int:
        """As `header_analog`, or channels times samples where these fill the file; -1: neither."""
        used = self.numbers("ANALOG", "USED")
        told = int(used[0]) * max(self.samples, 1) if used else self.header_analog
        if told == self.header_analog:
            return told
        width = 4 if (self.number("SCALE") or self.header_scale) < 0.0 else 2
        both = (self.header_analog, told)
        fits = [one for one in both if self._fills(width * (4 * self.points + one))]
        return fits[0] if len(fits) == 1 else -1

    def _fills(self, bytes_of_frame: int) -> bool:
        """Whether the frames that are told, so large, fill the file up to less than a block."""
        left = len(self.data) - self.start
        return any(0 <= left - one * bytes_of_frame < BLOCK for one in self.frames_told)

    @property
    def labels(self) -> list[str]:
        """Names of markers, empty where there is none."""
        found = self.texts("POINT", "LABELS")[: self.points]
        return found + [""] * (self.points - len(found))

    @property
    def unit_text(self) -> str:
        """What the file says of the unit of lengths."""
        return next(iter(self.texts("POINT", "UNITS")), "")

    @property
    def frames_told(self) -> set[int]:
        """How many frames the file tells: by TRIAL alone, else by header and POINT.

        One number where they agree, two where they do not, none where neither tells it: a count of
        `COUNT_ENDS` is a full counter and tells nothing.
        """
        # TRIAL has two 16-bit words for each end, the lower first: enough for any recording
        start, end = (self.numbers("TRIAL", f"ACTUAL_{end}_FIELD")[:2] for end in ("START", "END"))
        if end and sum(end) > 0.0:
            of_start, of_end = (
                sum(word * 65_536.0**k for k, word in enumerate(words))
                for words in (start or [float(max(self.first, 1))], end)
            )
            return {int(of_end - of_start + 1)}
        told = list[float]()
        if self.last < COUNT_ENDS:
            told.append(self.last - self.first + 1)
        if (frames := self.number("FRAMES")) is not None and np.isfinite(frames):
            told.append(frames)
        return {int(one) for one in told if 0 < one < COUNT_ENDS or one > COUNT_ENDS}

    def bytes_of_frame(self, scale: float) -> int:
        """Bytes of a frame: four numbers a marker, and the analog channels."""
        return (4 if scale < 0.0 else 2) * (4 * self.points + self.analog)

    def _left(self, scale: float) -> int:
        return len(self.data) - self.start if self.bytes_of_frame(scale) else 0

    @cached_property
    def room(self) -> int:
        """Frames for which there are bytes; 0 where they would begin within the parameters."""
        if self.start < self.behind or not self._left(self.scale):
            return 0
        return self._left(self.scale) // self.bytes_of_frame(self.scale)

    @cached_property
    def frames(self) -> int:
        """Number of frames, as told; where nothing tells it, as many as there is room for.

        The last block of a file is filled up with noughts, which are no frames. Of two numbers
        that contradict each other it is one of them: `contradictions` has such files.
        """
        if told := self.frames_told:
            return self.room if self.off_by_one else next(iter(told))
        size = self.bytes_of_frame(self.scale)
        padding = self.data[max(self.start, len(self.data) - BLOCK + 1) :]
        filled = len(padding) - len(padding.rstrip(b"\0"))
        empty = max(0, filled - (self._left(self.scale) - self.room * size)) // size if size else 0
        return self.room - empty

    @property
    def off_by_one(self) -> bool:
        """Whether header and parameters differ by one frame, of which the file's size has one."""
        told = sorted(self.frames_told)
        return len(told) == 2 and told[1] - told[0] == 1 and self.room in told

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the file contradicts itself in, and what was believed."""
        found = list[str]()
        if self.header_scale * (self.number("SCALE") or 0.0) < 0.0:
            found.append(BELIEVED_SCALE.format("reals" if self.scale < 0.0 else "whole numbers"))
        if self.analog != self.header_analog:
            found.append(BELIEVED_ANALOG)
        if self.off_by_one:
            found.append(BELIEVED_FRAMES.format(self.frames))
        return tuple(found)

    def cells(self) -> NDArray[np.float32] | NDArray[np.int16]:
        """(F, 4 K + A) all numbers of the frames as they stand there, whole numbers with a sign."""
        number = self.frames * (4 * self.points + self.analog)
        if self.scale < 0.0:
            cells = reals(self.data, self.start, number, self.processor)
        else:
            cells = words(self.data, self.start, number, self.processor).view("i2")
        return cells.reshape(self.frames, -1)

    def time_s(self, samples: int = 1) -> NDArray[np.float64]:
        """(F samples,) s, 0 at frame 1 of the recording; so many samples a frame."""
        number = np.arange(self.frames * samples) / samples
        found: NDArray[np.float64] = (max(self.first - 1, 0) + number) / self.rate
        return found


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
    whole = open_c3d(path, file)
    unit_m = unit_of(file, None, "POINT:UNITS", whole.unit_text)
    # four numbers a marker: its place and a residual; then analog channels
    points = whole.cells()[:, : 4 * whole.points].reshape(whole.frames, -1, 4)
    places = points[..., :3].astype(np.float64)
    places *= unit_m * (1.0 if whole.scale < 0.0 else whole.scale)
    places[points[..., 3] < 0] = np.nan
    return recording_from(tuple(whole.labels), whole.time_s(), places, whole.remarks)


def open_c3d(path: Path, file: str, markers: bool = True) -> C3dFile:
    """A `.c3d` whose header, parameters and size agree; whether markers must be in it.

    Raises
    ------
    InputError
        Where they do not.
    """
    try:
        whole = parse_c3d(path.read_bytes())
    except FormError as error:
        raise InputError([InputProblem(file, None, None, str(error), "a .c3d", AGAIN)]) from error
    if problems := list(_contradictions(whole, file, markers)):
        raise InputError(problems)
    return whole


def _contradictions(whole: C3dFile, file: str, markers: bool) -> Iterator[InputProblem]:
    """What the file tells that cannot be, or that header and parameters tell differently."""

    def problem(place: str, found: str, allowed: str) -> InputProblem:
        return InputProblem(file, None, place, found, allowed, AGAIN)

    if not SLOWEST <= whole.rate <= FASTEST:
        allowed = f"{SLOWEST:g} to {FASTEST:g} frames a second"
        yield problem("POINT:RATE", f"{whole.rate:g} frames a second", allowed)
    if not np.isfinite(whole.scale) or whole.scale == 0.0:
        found, allowed = f"a scale of {whole.scale:g}", "a finite number that is not zero"
        if np.isfinite(scale := whole.number("SCALE") or np.nan):
            found = f"a scale of {scale:g}, and {whole.header_scale:g} in the header"
            allowed = "the same sign: below zero for reals, above it for whole numbers"
        yield problem("POINT:SCALE", found, allowed)
        return
    if whole.analog < 0:
        found = f"{whole.header_analog} analog numbers a frame in the header"
        allowed = "channels times samples a frame, as the parameters tell"
        yield problem("ANALOG:USED", found, allowed)
        return
    used = whole.number("USED")
    if (markers and not whole.points) or (used is not None and used != whole.points):
        told = "" if used is None else f", {used:g} in its parameters"
        found = f"{whole.points} markers in the header{told}"
        yield problem("POINT:USED", found, "at least one, the same twice")
        return
    frames = whole.frames_told
    if len(frames) > 1 and not whole.off_by_one:
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
    # reading ends where frames begin, if that is behind the parameters, or else with the file
    (block,) = words(data, 16, 1, processor).tolist()
    end = (block - 1) * BLOCK if start < (block - 1) * BLOCK < len(data) else len(data)
    parameters, sizes, behind = _parameters(data[:end], start + 4, processor)
    # the header, by bytes: four 16-bit words from 2, the scale at 12, first block of frames at 16,
    # the rate at 20
    points, analog, first, last = words(data, 2, 4, processor).tolist()
    (scale,), (rate,) = reals(data, 12, 1, processor), reals(data, 20, 1, processor)
    (samples,) = words(data, 18, 1, processor).tolist()
    start = (block - 1) * BLOCK
    return C3dFile(
        *(data, processor, parameters, sizes, behind, points, analog, samples, first, last),
        start,
        float(scale),
        float(rate),
    )


def words(data: bytes, at: int, number: int, processor: int) -> NDArray[np.uint16]:
    """(number,) 16-bit numbers without a sign, from byte ``at`` on."""
    found = np.frombuffer(data, "<u2", number, at)
    return found.byteswap() if processor == MIPS else found


def reals(data: bytes, at: int, number: int, processor: int) -> NDArray[np.float32]:
    """(number,) 32-bit reals, from byte ``at`` on.

    A DEC writes the two 16-bit halves in the other order, and the same bits, read as IEEE's, are
    four times its number.
    """
    if processor != DEC:
        found = np.frombuffer(data, "<f4", number, at)
        return found.byteswap() if processor == MIPS else found
    halves = np.frombuffer(data, "<u2", 2 * number, at).reshape(-1, 2)
    return np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel() * np.float32(0.25)


def _parameters(
    data: bytes, at: int, processor: int
) -> tuple[Parameters, dict[tuple[str, str], tuple[int, ...]], int]:
    """All parameters, the sizes of their arrays, and where the list ends.

    That is its last entry, the empty one behind that, or the end of the section: programs of SGI
    let the last entry lead beyond it. An entry: length of its name, number of its group, name, way
    to the next entry, and of a parameter its value. Entries with a negative group number are the
    groups themselves.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, tuple[int, ...], Value]] = []
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
            found.append((group, name, *_value(data, way_at + 2, name, processor)))
        # counted from the way itself, which has 2 bytes; 0 at the last entry. Never backwards
        if way < 0 or (0 < way < 2):
            raise FormError(f"a parameter {name!a} that leads nowhere")
        if not way:
            break
        at = way_at + way
    named = [((groups.get(group, ""), name), size, value) for group, name, size, value in found]
    values = {key: value for key, _, value in named}
    return values, {key: size for key, size, _ in named}, min(at, len(data))


def _value(data: bytes, at: int, name: str, processor: int) -> tuple[tuple[int, ...], Value]:
    """Sizes of the array of a parameter, and the array, flat, its first index changing fastest.

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
        return tuple(sizes), tuple(
            piece.decode("utf-8", "replace").strip(" \0") for piece in pieces
        )
    if kind == BYTE:
        return tuple(sizes), tuple(map(float, data[begin : begin + size]))
    if kind == WORD:
        return tuple(sizes), tuple(map(float, words(data, begin, prod(sizes), processor)))
    if kind == REAL:
        return tuple(sizes), tuple(map(float, reals(data, begin, prod(sizes), processor)))
    raise FormError(f"a parameter {name!a} of type {kind}")
