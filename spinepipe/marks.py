"""The mark of a result file: one digest of all that it hangs on, kept inside the file itself.

Parquet files hold it in their metadata, JSON files as their last key, OpenSim's motions in their
header, all others at their end.
"""

import re
import struct
import zlib
from pathlib import Path
from typing import Any, BinaryIO

from spinepipe.files import appearing

KEY = "result_digest"
"""Name of the mark in every file."""

_LENGTH = 64
_TEXTS = {
    ".svg": "<!-- {} -->\n",
    ".html": "<!-- {} -->\n",
    ".osim": "<!-- {} -->\n",
    ".yaml": "# {}\n",
    ".csv": "# {}\n",
}
"""Kinds of text that end with the mark, and how a remark is written in them."""

_TAIL_BYTES = 256
_AT_END = re.compile(
    KEY.encode()
    + rb'(?:: |": "|\0)([0-9a-f]{64})'
    + rb'(?: -->\n|\n|"\s*\}\s*|.{4}\0{4}IEND.{4})\Z',
    re.DOTALL,
)
"""The mark, and what a whole file has after it: nothing, the end of JSON or the end of a PNG."""

_MOTION = ".mot"
_HEAD_END = b"endheader\n"
_IN_HEAD = re.compile(
    rb"\A.*?\nnRows=(\d+)\n.*?\n" + KEY.encode() + rb"=([0-9a-f]{64})\nendheader\n", re.DOTALL
)
"""Rows that a whole motion has below its names of columns, and the mark."""

_PARQUET = b"PAR1"
_PARQUET_END_BYTES = 8
_IN_FOOTER = re.compile(KEY.encode() + rb"\x18\x40([0-9a-f]{64})")
"""The mark in the compact form of Thrift: next field, text of 64 bytes."""

_PNG_END = b"IEND"
_PNG_FIELD_BYTES = 4


def marked(content: str | bytes, suffix: str, digest: str) -> bytes:
    """Content of a text or picture with its mark; without a digest as it is.

    Raises
    ------
    ValueError
        For a kind of file that cannot carry one.
    """
    raw = content.encode() if isinstance(content, str) else content
    if not digest:
        return raw
    assert len(digest) == _LENGTH
    if suffix == ".png":
        return _marked_png(raw, digest)
    if suffix == _MOTION:
        return raw.replace(_HEAD_END, f"{KEY}={digest}\n".encode() + _HEAD_END, 1)
    if suffix not in _TEXTS:
        able = ".json", ".png", _MOTION, *_TEXTS
        raise ValueError(f"a file {suffix} carries no mark: {', '.join(able)}")
    return raw + _TEXTS[suffix].format(f"{KEY}: {digest}").encode()


def _marked_png(raw: bytes, digest: str) -> bytes:
    """The picture with a text chunk before its last one."""
    end = raw.rindex(_PNG_END) - _PNG_FIELD_BYTES
    chunk = b"tEXt" + KEY.encode() + b"\0" + digest.encode()
    size = struct.pack(">I", len(chunk) - _PNG_FIELD_BYTES)
    return raw[:end] + size + chunk + struct.pack(">I", zlib.crc32(chunk)) + raw[end:]


def write_marked(content: str | bytes, path: str | Path, digest: str) -> None:
    """Write a text or picture with its mark; it appears whole or not at all."""
    path = Path(path)
    raw = marked(content, path.suffix, digest)
    with appearing(path) as temporary:
        temporary.write_bytes(raw)


def with_mark(data: dict[str, Any], digest: str) -> dict[str, Any]:
    """Data of a JSON file with the mark as last key."""
    return {**data, KEY: digest}


def without_mark(data: dict[str, Any]) -> dict[str, Any]:
    """Data of a JSON file without the mark."""
    return {key: value for key, value in data.items() if key != KEY}


def read_mark(path: str | Path) -> str:
    """The mark of a file; empty for a file that has none or cannot be read as what it is called."""
    with open(path, "rb") as file:
        if str(path).endswith(".parquet"):
            found = _IN_FOOTER.search(_footer(file))
        elif str(path).endswith(_MOTION):
            return _mark_of_motion(file.read())
        else:
            found = _AT_END.search(_tail(file, _TAIL_BYTES))
    return found[1].decode() if found else ""


def _mark_of_motion(raw: bytes) -> str:
    """The mark in the header, if all rows are there."""
    found = _IN_HEAD.match(raw)
    if not found or not raw.endswith(b"\n"):
        return ""
    rows = raw.count(b"\n", found.end()) - 1
    return found[2].decode() if rows == int(found[1]) else ""


def _footer(file: BinaryIO) -> bytes:
    """Metadata of a Parquet file; of thousands of files pyarrow would take ten times as long."""
    end = _tail(file, _PARQUET_END_BYTES)
    if len(end) < _PARQUET_END_BYTES or not end.endswith(_PARQUET):
        return b""
    (size,) = struct.unpack("<I", end[: -len(_PARQUET)])
    return _tail(file, size + _PARQUET_END_BYTES)


def _tail(file: BinaryIO, size: int) -> bytes:
    file.seek(max(0, file.seek(0, 2) - size))
    return file.read()
