"""Files of motion as `.c3d`, put together byte by byte: processors, whole numbers, what is told."""

import struct
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spinepipe.motion.c3d_parameters import DEC, INTEL, MIPS, FormError
from spinepipe.motion.reading import read_motion
from spinepipe.motion.reading_c3d import parse_c3d
from spinepipe.problems import InputError, InputProblem

PLACES_MM = np.array(
    [[[-7, 20, 300], [4, -5, 6]], [[1, 2, 3], [40, 50, 60]], [[9, 8, 7], [1, 1, 1]]]
)
"""(F, K, 3) of three frames and two markers; whole numbers, so that both forms hold them."""


def real(value: float, processor: int) -> bytes:
    """A DEC's has exchanged halves and is four times as large."""
    if processor != DEC:
        return struct.pack(">f" if processor == MIPS else "<f", value)
    low, high = struct.unpack("<HH", struct.pack("<f", 4.0 * value))
    return struct.pack("<HH", high, low)


def word(value: int, processor: int) -> bytes:
    return struct.pack(">H" if processor == MIPS else "<H", value % 65_536)


@dataclass(frozen=True)
class Made:
    """A file of two markers, and one number of analog channels behind each frame."""

    processor: int = INTEL
    scale: float = -1.0
    header: dict[str, int] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    frames: int = 3
    labels: tuple[str, ...] = ("T1", "L3")
    locked: bool = False
    data_scale: float | None = None
    padding: int = 0
    trial: tuple[tuple[int, int], tuple[int, int]] | None = None

    def text(self) -> bytes:
        head = {"points": 2, "analog": 1, "first": 11, "last": 13, "block": 3} | self.header
        block = bytearray(512)
        block[:2] = 2, 0x50
        for at, name in ((2, "points"), (4, "analog"), (6, "first"), (8, "last"), (16, "block")):
            block[at : at + 2] = word(head[name], self.processor)
        block[12:16] = real(self.scale, self.processor)
        block[20:24] = real(self.numbers.get("RATE", 50.0), self.processor)
        return (
            bytes(block) + self._parameters().ljust(512, b"\0") + self._data() + bytes(self.padding)
        )

    def _parameters(self) -> bytes:
        told = {"RATE": 50.0, "SCALE": self.scale} | self.numbers
        entries = [self._entry("point", -1, b"")]
        entries += [self._entry(k, 1, self._number(v)) for k, v in told.items()]
        width = max(map(len, self.labels))
        letters = "".join(one.ljust(width) for one in self.labels).encode()
        sizes = struct.pack("<bBBB", -1, 2, width, len(self.labels))
        entries.append(self._entry("Labels", 1, sizes + letters))
        entries.append(self._entry("UNITS", 1, struct.pack("<bBB", -1, 1, 2) + b"mm"))
        if self.trial:
            entries.append(self._entry("TRIAL", -2, b""))
            for end, pair in zip(("START", "END"), self.trial, strict=True):
                value = struct.pack("<bBB", 2, 1, 2)
                value += b"".join(word(one, self.processor) for one in pair)
                entries.append(self._entry(f"ACTUAL_{end}_FIELD", 2, value))
        return bytes((1, 0x50, 1, self.processor)) + b"".join(entries) + b"\0\0"

    def _number(self, value: float) -> bytes:
        return struct.pack("<bB", 4, 0) + real(value, self.processor)

    def _entry(self, name: str, group: int, value: bytes) -> bytes:
        rest = value + b"\0"  # no description
        way = word(2 + len(rest), self.processor)
        length = -len(name) if self.locked else len(name)
        return struct.pack("<bb", length, group) + name.encode() + way + rest

    def _data(self) -> bytes:
        """The second marker is not seen in the second frame."""
        cells = []
        for frame in range(self.frames):
            for marker in range(2):
                lost = (frame, marker) == (1, 1)
                cells += [*PLACES_MM[frame % 3, marker].tolist(), -1 if lost else 0]
            cells.append(999)
        if (self.data_scale or self.scale) < 0.0:
            return b"".join(real(one, self.processor) for one in cells)
        return b"".join(word(one, self.processor) for one in cells)


def written(folder: Path, made: Made | bytes) -> Path:
    path = folder / "m.c3d"
    path.write_bytes(made if isinstance(made, bytes) else made.text())
    return path


@pytest.mark.parametrize("locked", [False, True])
@pytest.mark.parametrize("scale", [-1.0, 1.0, 0.5])
@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
def test_all_processors_and_both_forms_of_numbers_are_read(
    tmp_path: Path, processor: int, scale: float, locked: bool
) -> None:
    """Whole numbers are in units of the scale, reals are places; an analog number is left out."""
    found = read_motion(written(tmp_path, Made(processor, scale, locked=locked)))
    assert found.names == ("T1", "L3")
    np.testing.assert_allclose(found.time_s, np.array([10.0, 11.0, 12.0]) / 50.0)
    seen = np.array([[True, True], [True, False], [True, True]])
    np.testing.assert_array_equal(found.seen, seen)
    expected = PLACES_MM * (1e-3 if scale < 0.0 else 1e-3 * scale)
    np.testing.assert_allclose(found.places, np.where(seen[..., None], expected, 0.0), rtol=1e-12)


def test_parameters_go_by_group_and_name_in_capitals() -> None:
    parts = parse_c3d(Made(trial=((11, 0), (13, 0))).text())
    assert parts.parameters["POINT", "LABELS"] == ("T1", "L3")
    assert parts.parameters["POINT", "RATE"] == (50.0,)
    assert parts.parameters["TRIAL", "ACTUAL_END_FIELD"] == (13.0, 0.0)
    assert (parts.first, parts.last, parts.start) == (11, 13, 1024)
    assert (parts.points, parts.analog) == (2, 1)
    assert (parts.header_scale, parts.header_rate) == (-1.0, 50.0)


def entry_of(kind: int, sizes: tuple[int, ...], value: bytes, way: int | None = None) -> bytes:
    """A file with one parameter A in place of all."""
    rest = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + value
    step = struct.pack("<h", 2 + len(rest) if way is None else way)
    whole = bytes((1, 0x50, 1, INTEL)) + b"\x01\x01A" + step + rest + b"\0\0"
    return Made().text()[:512] + whole.ljust(512, b"\0")


def last_entry(text: bytes) -> bytes:
    """A file of two blocks with one sound parameter, and so many bytes of another at its end."""
    return entry_of(1, (1,), b"\0", 1024 - len(text) - 519)[: 1024 - len(text)] + text


@pytest.mark.parametrize(
    ("kind", "sizes", "value", "expected"),
    [
        (1, (3,), b"\x01\x02\xff", (1.0, 2.0, 255.0)),
        (2, (2, 1), b"\x01\x00\x00\x02", (1.0, 512.0)),
        (4, (), struct.pack("<f", 2.5), (2.5,)),
        (-1, (), b"x", ("x",)),
        (-1, (4,), b"ab \0", ("ab",)),
        (-1, (2, 3), b"a bbc ", ("a", "bb", "c")),
        (-1, (1, 2, 2), b"abcd", ("a", "b", "c", "d")),
        (-1, (0, 3), b"", ()),
        (2, (0,), b"", ()),
        (1, (1,) * 7, b"\x09", (9.0,)),
    ],
)
def test_values_of_all_types(
    kind: int, sizes: tuple[int, ...], value: bytes, expected: tuple[Any, ...]
) -> None:
    found = parse_c3d(entry_of(kind, sizes, value)).parameters
    assert found == {("", "A"): expected}


def test_a_parameter_that_leads_on_by_nought_or_ends_the_file_is_the_last() -> None:
    found = parse_c3d(entry_of(1, (1,), b"\x07", 0))
    assert found.parameters == {("", "A"): (7.0,)}
    found = parse_c3d(last_entry(b"\x01\xffB\x00\x00"))
    assert found.parameters == {("B", "A"): (0.0,)}


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (Made().text()[:1023], "no header"),
        (b"\x02\x51" + Made().text()[2:], "no header"),
        (b"\x02\x4f" + Made().text()[2:], "no header"),
        (b"\x01\x50" + Made().text()[2:], "no header"),
        (b"\x05\x50" + Made().text()[2:1024], "ends before its parameters"),
        (replace(Made(), processor=83).text(), "a processor 83"),
        (replace(Made(), processor=87).text(), "a processor 87"),
        (entry_of(3, (1,), b"\0\0\0"), "'A' of type 3"),
        (entry_of(4, (255, 2), b""), "'A' of 2040 bytes, which are not there"),
        (entry_of(1, (1,), b"\0", 1), "'A' that leads nowhere"),
        (entry_of(1, (1,), b"\0", -3), "'A' that leads nowhere"),
        (last_entry(b"\x7f\x01AAAA"), "ends within its parameters"),
        (last_entry(b"\x81\x01AAAA"), "ends within its parameters"),
        (last_entry(b"\x01\x01A\x00\x00\x01"), "ends within its parameters"),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_what_does_not_hold_together_is_told(data: bytes, says: str) -> None:
    with pytest.raises(FormError, match=says):
        parse_c3d(data)


FULL = {"last": 65_535}


def problem_of(folder: Path, made: Made | bytes) -> InputProblem:
    with pytest.raises(InputError) as caught:
        read_motion(written(folder, made))
    return caught.value.problems[0]


@pytest.mark.parametrize(
    ("changed", "place", "says"),
    [
        ({"numbers": {"RATE": 0.99}}, "RATE", "0.99 frames a second"),
        ({"numbers": {"RATE": 100_001.0}}, "RATE", "100001 frames a second"),
        ({"numbers": {"RATE": float("nan")}}, "RATE", "nan frames a second"),
        ({"numbers": {"SCALE": float("inf")}}, "SCALE", "a scale of inf"),
        ({"numbers": {"USED": 3.0}}, "USED", "2 markers in the header, 3 in its parameters"),
        ({"numbers": {"USED": 1.0}}, "USED", "2 markers in the header, 1 in its parameters"),
        ({"header": {"points": 0}}, "USED", "0 markers in the header"),
        ({"numbers": {"FRAMES": 5.0}}, "FRAMES", "3 frames and 5 frames"),
        ({"numbers": {"FRAMES": 5.0}, "frames": 2}, "FRAMES", "3 frames and 5 frames"),
        ({"header": {"first": 14}}, "FRAMES", "frames from 14 to 13"),
        ({"frames": 2}, "FRAMES", "room for 2 of 3 frames"),
        ({"header": {"block": 2}}, "FRAMES", "room for 0 of 3 frames"),
        ({"trial": ((11, 0), (15, 0)), "header": FULL}, "FRAMES", "room for 3 of 5 frames"),
        ({"trial": ((1, 0), (1, 1)), "header": FULL}, "FRAMES", "room for 3 of 65537 frames"),
    ],
)
def test_contradictions_are_told_with_both_sides(
    tmp_path: Path, changed: dict[str, Any], place: str, says: str
) -> None:
    problem = problem_of(tmp_path, replace(Made(), **changed))
    assert (problem.column, problem.found) == (f"POINT:{place}", says)


@pytest.mark.parametrize(
    "changed",
    [
        {"numbers": {"RATE": 1.0}},
        {"numbers": {"RATE": 100_000.0}},
        {"numbers": {"USED": 2.0, "FRAMES": 3.0}},
        {"header": {"first": 13, "last": 13}},
        {"trial": ((11, 0), (13, 0)), "header": {"last": 65_535}},
        {"header": {"last": 65_535}, "numbers": {"FRAMES": 65_535.0}},
        {"labels": ("T1", "L3", "more")},
    ],
)
def test_what_agrees_is_read(tmp_path: Path, changed: dict[str, Any]) -> None:
    """Also one frame, clocks that are full, and names that nobody asks for."""
    found = read_motion(written(tmp_path, replace(Made(), **changed)))
    count = 1 if changed.get("header") == {"first": 13, "last": 13} else 3
    assert found.names == ("T1", "L3")
    assert len(found.time_s) == count


def test_frames_that_a_trial_counts_beyond_16_bits_are_all_read(tmp_path: Path) -> None:
    """From frame 1 to 65,537: the second word counts 65,536."""
    made = Made(header={"first": 1, "last": 65_535}, trial=((1, 0), (1, 1)), frames=65_537)
    assert len(read_motion(written(tmp_path, made)).time_s) == 65_537


@pytest.mark.parametrize("scale", [-1.0, 1.0])
def test_of_two_signs_of_the_scale_the_file_s_size_tells_the_right_one(
    tmp_path: Path, scale: float
) -> None:
    """Whole numbers take half the room of reals: 300 frames tell them apart, 3 do not."""
    signs = {"scale": -scale, "numbers": {"SCALE": scale}, "data_scale": scale}
    made = Made(header={"first": 1, "last": 300}, frames=300, padding=100, **signs)
    found = read_motion(written(tmp_path, made))
    np.testing.assert_allclose(
        1e3 * found.places[:3][found.seen[:3]], PLACES_MM.reshape(-1, 3)[[0, 1, 2, 4, 5]]
    )
    assert "header and POINT:SCALE differ in sign" in found.repaired[0]
    few = problem_of(tmp_path, Made(padding=300, **signs))
    assert (few.column, few.found) == (
        "POINT:SCALE",
        f"a scale of {scale:g}, and {-scale:g} in the header",
    )


def test_a_count_that_is_off_by_one_is_told(tmp_path: Path) -> None:
    found = read_motion(written(tmp_path, Made(numbers={"FRAMES": 4.0})))
    assert len(found.time_s) == 3
    assert "the file's size fits 3" in found.repaired[0]


def test_padding_of_the_last_block_is_no_frame(tmp_path: Path) -> None:
    """36 bytes a frame: 14 would fit into the padding."""
    full = {"header": {"first": 1, "last": 65_535}, "frames": 70_000, "padding": 511}
    assert len(read_motion(written(tmp_path, Made(**full))).time_s) == 70_000
    made = Made(**full, trial=((1, 0), (4464, 1)))
    assert len(read_motion(written(tmp_path, made)).time_s) == 70_000


@pytest.mark.parametrize(
    ("changed", "frames"),
    [
        ({"trial": ((11, 0), (15, 0))}, 30),
        ({"trial": ((11, 0), (12, 0))}, 30),
        ({"numbers": {"FRAMES": 29.0}, "padding": 200}, 30),
        ({"numbers": {"FRAMES": 31.0}, "padding": 200}, 30),
        ({"header": {"first": 1, "last": 4464}, "numbers": {"FRAMES": 4464.0}}, 70_000),
    ],
)
def test_of_several_numbers_of_frames_the_file_s_size_tells_the_right_one(
    tmp_path: Path, changed: dict[str, Any], frames: int
) -> None:
    """A counter of 16 bits begins again at nought; padding is less than a block."""
    made = replace(Made(header={"last": 40}, frames=frames), **changed)
    found = read_motion(written(tmp_path, made))
    assert len(found.time_s) == frames
    assert f"the file's size fits {frames}, which were read" in found.repaired[0]


@pytest.mark.parametrize("first", [65_535, 4465, 65_530])
def test_a_crop_begins_where_the_trial_says_beyond_16_bits(tmp_path: Path, first: int) -> None:
    start = 65_530 if first == 65_530 else 70_001
    last = 65_535 if first == 65_535 else (start + 2) % 65_536
    trial = tuple((one % 65_536, one // 65_536) for one in (start, start + 2))
    made = Made(header={"first": first, "last": last}, trial=(trial[0], trial[1]))
    found = read_motion(written(tmp_path, made))
    np.testing.assert_allclose(found.time_s, np.arange(start - 1, start + 2) / 50.0)
    assert not found.repaired


def test_reading_of_parameters_ends_with_their_section() -> None:
    """The last entry of some leads into the frames, or beyond the file."""
    for way in (530, 5000):
        assert parse_c3d(entry_of(1, (1,), b"\x07", way)).parameters == {("", "A"): (7.0,)}
