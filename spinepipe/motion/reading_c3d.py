"""Motion as `.c3d`: unit and rate are the file's own; a negative residual says: not seen.

Parameters of the same files: `c3d_parameters`; force plates: `reading_plates`.

By The C3D File Format, User Guide (2008). The file has blocks of 512 bytes, counted from 1:

- block 1, the header: where parameters and frames begin, how many markers, frames a second;
- parameters, some of which tell again what the header tells;
- frames: four numbers a marker (x, y, z, residual), then the analog channels. All are 32-bit reals,
  or all 16-bit whole numbers, of which x, y, z are to be multiplied by the *scale*.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spinepipe.motion.c3d_parameters import (
    DEC,
    INTEL,
    MIPS,
    REAL,
    WORD,
    FormError,
    Parameters,
    elements,
    numbers_at,
    read_parameters,
)
from spinepipe.motion.recording import MarkerRecording, recording_from, unit_of
from spinepipe.problems import InputError, InputProblem

BLOCK = 512
"""Bytes."""

MAGIC = 0x50
"""Second byte of every such file."""

SLOWEST, FASTEST = 1.0, 100_000.0
"""Frames a second that are taken for possible."""

COUNT_ENDS = 65_535
"""Largest number of 16 bits. Longer recordings have it as number of frames, which tells nothing, or
begin to count again at nought."""

BELIEVED_SCALE = "header and POINT:SCALE differ in sign; the file's size fits {}"
BELIEVED_ANALOG = "header and ANALOG:USED differ; the file's size fits {} numbers a frame"
BELIEVED_FRAMES = "{} frames are told; the file's size fits {}, which were read"

AGAIN = "export the motion again"


@dataclass(frozen=True)
class C3dFile:
    """Header and parameters of a file, and all its bytes.

    Attributes
    ----------
    data : all bytes. processor, parameters : see `c3d_parameters`.
    behind : where the list of parameters ends; no frame begins before it.
    points, header_analog : in a frame, how many markers, and how many numbers of analog channels
        (samples of all channels). samples : of each channel in a frame.
    first, last : of the first and the last frame, its number in the recording, from 1; by the
        header. start : byte from 0 where frames begin.
    header_scale : what whole numbers are multiplied by to be in POINT:UNITS; negative: frames are
        reals. header_rate : frames a second. Both are used where POINT does not tell them.
    """

    data: bytes
    processor: int
    parameters: Parameters
    behind: int
    points: int
    header_analog: int
    samples: int
    first: int
    last: int
    start: int
    header_scale: float
    header_rate: float

    def texts(self, group: str, name: str) -> list[str]:
        """Texts of a parameter; none where there is none, or it has numbers."""
        return [one for one in elements(self.parameters, group, name) if isinstance(one, str)]

    def numbers(self, group: str, name: str) -> list[float]:
        """Numbers of a parameter; none where there is none, or it has texts."""
        return [one for one in elements(self.parameters, group, name) if isinstance(one, float)]

    def number(self, name: str) -> float | None:
        """The first number of a parameter of POINT; None where there is none."""
        return next(iter(self.numbers("POINT", name)), None)

    def unit_m(self, file: str) -> float:
        """What one unit of lengths is in m; ``file`` is the name in messages.

        Raises
        ------
        InputError
            Where the file tells none.
        """
        return unit_of(file, None, "POINT:UNITS", "".join(self.texts("POINT", "UNITS")[:1]))

    @property
    def rate(self) -> float:
        """Frames a second; the header's where POINT tells none or 0."""
        return self.number("RATE") or self.header_rate

    @cached_property
    def layouts(self) -> list[tuple[float, int]]:
        """Scales and numbers of analog channels that frames may have, as header and parameters say.

        Where the two differ, in the sign of the scale or the analog numbers, only those with which
        the frames that are told fill the file up to less than a block.
        """
        scales, analog = [self.number("SCALE") or self.header_scale], [self.header_analog]
        if -np.inf < scales[0] * self.header_scale < 0.0:
            scales.append(self.header_scale)
        used = self.numbers("ANALOG", "USED")
        if used and (told := int(used[0]) * max(self.samples, 1)) != self.header_analog:
            analog.append(told)
        every = list(product(scales, analog))
        return every if len(every) == 1 else [one for one in every if self.fitting(*one)]

    @property
    def scale(self) -> float:
        """As `header_scale`."""
        return self.layouts[0][0]

    @property
    def analog(self) -> int:
        """As `header_analog`."""
        return self.layouts[0][1]

    def bytes_of_frame(self, scale: float, analog: int) -> int:
        """Bytes of a frame: four numbers a marker, and the analog channels."""
        return (4 if scale < 0.0 else 2) * (4 * self.points + analog)

    def trial_end(self, end: str) -> int:
        """Number of the first or last frame (``START`` or ``END``) by TRIAL; 0: it tells none."""
        # two 16-bit words, the lower first: enough for any recording
        words = self.numbers("TRIAL", f"ACTUAL_{end}_FIELD")[:2]
        return int(sum(word * (COUNT_ENDS + 1.0) ** k for k, word in enumerate(words)))

    @property
    def begin(self) -> int:
        """Number of the first frame, by TRIAL where the header's is a full counter or its rest."""
        told, rest = self.trial_end("START"), max(self.first, 1)
        goes_on = rest == COUNT_ENDS or (told - rest) % (COUNT_ENDS + 1) == 0
        return told if told > rest and goes_on else rest

    @cached_property
    def frames_told(self) -> set[int]:
        """How many frames TRIAL, header and POINT tell; full counters tell nothing."""
        told = [0.0]
        if self.trial_end("END"):
            told.append(self.trial_end("END") - (self.trial_end("START") or self.begin) + 1)
        if self.last < COUNT_ENDS:
            told.append((self.last - self.first + 1) % (COUNT_ENDS + 1))
        if (frames := self.number("FRAMES")) is not None and np.isfinite(frames):
            told.append(frames)
        return {int(one) for one in told if one > 0 and one != COUNT_ENDS}

    def room(self, scale: float, analog: int) -> int:
        """Frames for which there are bytes; 0 where they would begin within the parameters."""
        size = self.bytes_of_frame(scale, analog)
        return (len(self.data) - self.start) // size if size and self.start >= self.behind else 0

    def fitting(self, scale: float, analog: int) -> set[int]:
        """Numbers of frames that are told and fill the file up to less than a block.

        What is told may have lost a multiple of 65,536.
        """
        room, size = self.room(scale, analog), self.bytes_of_frame(scale, analog)
        left = len(self.data) - self.start
        pairs = [(room - (room - told) % (COUNT_ENDS + 1), told) for told in self.frames_told]
        return {one for one, told in pairs if one >= told and left - one * size < BLOCK}

    @cached_property
    def frames(self) -> int:
        """Number of frames, as told and as the file's size agrees with; else as there is room for.

        The last block of a file is filled up with noughts, which are no frames. 0: what is told
        differs, and its size fits none or several.
        """
        fitting, room = self.fitting(*self.layouts[0]), self.room(*self.layouts[0])
        if len(fitting) == 1 or (not fitting and len(self.frames_told) == 1):
            return next(iter(fitting or self.frames_told))
        if not room:
            return 0
        last_block = self.data[max(self.start, len(self.data) - BLOCK + 1) :]
        noughts = len(last_block) - len(last_block.rstrip(b"\0"))
        filled = len(self.data) - self.start - noughts
        whole = min(room, -(-filled // self.bytes_of_frame(*self.layouts[0])))
        return whole if whole in fitting or not self.frames_told else 0

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the file contradicts itself in, and what was believed."""
        found = list[str]()
        if self.header_scale * (self.number("SCALE") or 0.0) < 0.0:
            found.append(BELIEVED_SCALE.format("reals" if self.scale < 0.0 else "whole numbers"))
        if self.analog != self.header_analog:
            found.append(BELIEVED_ANALOG.format(self.analog))
        if self.frames_told - {self.frames}:
            told = " and ".join(map(str, sorted(self.frames_told)))
            found.append(BELIEVED_FRAMES.format(told, self.frames))
        return tuple(found)

    def cells(self) -> NDArray[np.float32] | NDArray[np.int16]:
        """(F, 4 K + A) all numbers of the frames as they stand there, whole numbers with a sign."""
        number = self.frames * (4 * self.points + self.analog)
        kind = REAL if self.scale < 0.0 else WORD
        cells = numbers_at(self.data, kind, self.start, number, self.processor)
        return cells.view("f4" if kind == REAL else "i2").reshape(self.frames, -1)

    def time_s(self, samples: int = 1) -> NDArray[np.float64]:
        """(F samples,) s, 0 at frame 1 of the recording; so many samples a frame."""
        number = np.arange(self.frames * samples) / samples
        found: NDArray[np.float64] = (self.begin - 1 + number) / self.rate
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
    # four numbers a marker: its place and a residual; then analog channels
    points = whole.cells()[:, : 4 * whole.points].reshape(whole.frames, -1, 4)
    places = points[..., :3].astype(np.float64)
    places *= whole.unit_m(file) * (1.0 if whole.scale < 0.0 else whole.scale)
    places[points[..., 3] < 0] = np.nan
    names = whole.texts("POINT", "LABELS")[: whole.points]
    names += [""] * (whole.points - len(names))
    return recording_from(tuple(names), whole.time_s(), places, whole.remarks)


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
    problems = [
        InputProblem(file, None, place, found, allowed, AGAIN)
        for place, found, allowed in _contradictions(whole, markers)
    ]
    if problems:
        raise InputError(problems)
    return whole


def _contradictions(whole: C3dFile, markers: bool) -> Iterator[tuple[str, str, str]]:
    """What the file tells that cannot be, or differently twice: where, what, what is allowed."""
    if not SLOWEST <= whole.rate <= FASTEST:
        allowed = f"{SLOWEST:g} to {FASTEST:g} frames a second"
        yield "POINT:RATE", f"{whole.rate:g} frames a second", allowed
    if len(whole.layouts) != 1:
        scale = whole.number("SCALE") or 0.0
        if scale * whole.header_scale < 0.0:
            found = f"a scale of {scale:g}, and {whole.header_scale:g} in the header"
            allowed = "the same sign: below zero for reals, above it for whole numbers"
            yield "POINT:SCALE", found, allowed
        else:
            found = f"{whole.header_analog} analog numbers a frame in the header"
            yield "ANALOG:USED", found, "channels times samples a frame, as the parameters tell"
        return
    if not np.isfinite(whole.scale) or whole.scale == 0.0:
        yield "POINT:SCALE", f"a scale of {whole.scale:g}", "a finite number that is not zero"
        return
    used = whole.number("USED")
    if (markers and not whole.points) or (used is not None and used != whole.points):
        told = "" if used is None else f", {used:g} in its parameters"
        found = f"{whole.points} markers in the header{told}"
        yield "POINT:USED", found, "at least one, the same twice"
        return
    frames, room = whole.frames_told, whole.room(*whole.layouts[0])
    header, point = whole.last - whole.first + 1, whole.number("FRAMES") or 0.0
    counts = bool(point) and COUNT_ENDS not in (whole.last, point) and not whole.trial_end("END")
    # one frame off, or a counter that began again, is settled by the size; more is of another file
    if counts and abs(point - header) > 1 and (point - header) % (COUNT_ENDS + 1):
        found = f"{header} frames and {point:g} frames"
        yield "POINT:FRAMES", found, "the same in header and parameters"
    elif len(frames) > 1 and not whole.frames:
        found = f"{' frames and '.join(map(str, sorted(frames)))} frames"
        yield "POINT:FRAMES", found, "the same in header and parameters, or what fills the file"
    elif whole.first > whole.last and (whole.last - whole.first + 1 - whole.frames) % (
        COUNT_ENDS + 1
    ):
        found = f"frames from {whole.first} to {whole.last}"
        yield "POINT:FRAMES", found, "a first frame before the last"
    elif not whole.frames or whole.frames > room:
        told = f" of {next(iter(frames))}" if frames else ""
        found = f"room for {room}{told} frames"
        yield "POINT:FRAMES", found, "all that are told; the file may be cut off"


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
    # the header, by bytes: four 16-bit words from 2, the scale at 12, first block of frames at 16,
    # samples a frame at 18, the rate at 20
    words = numbers_at(data, WORD, 2, 9, processor).tolist()
    (points, analog, first, last), (block, samples) = words[:4], words[7:]
    scale, _, rate = numbers_at(data, REAL, 12, 3, processor).tolist()
    # parameters end where frames begin, if that is behind them, or else with the file
    frames = (block - 1) * BLOCK
    end = frames if start < frames < len(data) else len(data)
    parameters, behind = read_parameters(data[:end], start + 4, processor)
    return C3dFile(
        *(data, processor, parameters, behind, points, analog, samples, first, last, frames),
        *(scale, rate),
    )
