"""Seconds and memory that a recording of 100 MB takes: markers as text, reals and whole numbers."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.memory import peak_mib
from benchmarks.timing import cpu_seconds
from spinepipe.motion.reading import read_motion

MARKERS = 80
BYTES = 100_000_000
GOAL_S, GOAL_MIB = 10.0, 1000.0


@dataclass(frozen=True)
class Read:
    """One file that was read."""

    what: str
    mb: float
    seconds: float
    peak_mib: float


def reads() -> Iterator[Read]:
    """Each kind of file; memory is that of a process that reads it once."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("text.trc", "ragged.trc", "reals.c3d", "whole_numbers.c3d"):
            path = Path(folder) / name
            write = _trc if path.suffix == ".trc" else _c3d
            write(path)
            seconds = cpu_seconds(lambda path=path: read_motion(path), 1, 0).median
            program = (
                "from pathlib import Path\nfrom spinepipe.motion.reading import read_motion\n"
                f"read_motion(Path({str(path)!r}))\n"
            )
            yield Read(name, path.stat().st_size / 1e6, seconds, peak_mib(program))
            path.unlink()


def _trc(path: Path) -> None:
    """Times to three decimals, places to five; ragged: each other row without its last cells."""
    block = np.random.default_rng(1).uniform(-999.0, 1999.0, (100, 3 * MARKERS))
    rows = ["\t".join(f"{one:.5f}" for one in row) for row in block]
    if path.name.startswith("ragged"):
        rows[::2] = [row.rsplit("\t", 3)[0] for row in rows[::2]]
    frames = BYTES // (len(rows[0]) + 15)
    names = "\t\t\t".join(f"M{k}" for k in range(MARKERS))
    with path.open("w") as file:
        file.write("PathFileType\t4\t(X/Y/Z)\tm.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n")
        file.write(f"100\t{frames}\t{MARKERS}\tmm\nFrame#\tTime\t{names}\n\t\tX1\n\n")
        file.writelines(f"{k + 1}\t{k / 100:.3f}\t{rows[k % 100]}\n" for k in range(frames))


def _c3d(path: Path) -> None:
    """By the form alone: a header, four parameters, frames."""
    reals = path.name.startswith("reals")
    scale, kind = (-1.0, "<f4") if reals else (0.1, "<i2")
    frames = BYTES // (4 * MARKERS * (4 if reals else 2))
    labels = "".join(f"M{k:<3d}" for k in range(MARKERS)).encode()

    def entry(name: bytes, value: bytes) -> bytes:
        way = np.array([3 + len(value)], "<i2").tobytes()
        return bytes([len(name), 1]) + name + way + value + b"\0"

    def real(value: float) -> bytes:
        return np.array([value], "<f4").tobytes()

    words = [bytes([4, 0]) + real(value) for value in (scale, 100.0, float(frames))]
    section = bytes([1, 0x50, 2, 84, 5, 255]) + b"POINT" + bytes([3, 0, 0])
    for name, value in zip((b"SCALE", b"RATE", b"FRAMES"), words, strict=True):
        section += entry(name, value)
    section += entry(b"UNITS", bytes([255, 1, 2]) + b"mm")
    section += entry(b"LABELS", bytes([255, 2, 4, MARKERS]) + labels)
    header = bytearray(512)
    header[:2] = 2, 0x50
    header[2:10] = np.array([MARKERS, 0, 1, min(frames, 65_535)], "<u2").tobytes()
    header[12:16], header[16:18], header[20:24] = real(scale), b"\4\0", real(100.0)
    block = np.random.default_rng(1).uniform(-9999, 19_999, (100, 4 * MARKERS)).astype(kind)
    block[:, 3::4] = 0
    with path.open("wb") as file:
        file.write(bytes(header) + section.ljust(1024, b"\0"))
        for _ in range(frames // 100 + 1):
            file.write(block.tobytes())
        file.truncate(1536 + frames * block[0].nbytes)
