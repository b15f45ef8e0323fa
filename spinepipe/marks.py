"""The mark of a result file: one digest of all that it hangs on, kept inside the file itself.

Parquet files hold it in their metadata, JSON files as their last key, all others at their end.
"""

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from spinepipe.files import appearing

KEY = "result_digest"
"""Name of the mark in every file."""

_LENGTH = 64
_TEXTS = {".svg": "<!-- {} -->\n", ".html": "<!-- {} -->\n", ".yaml": "# {}\n"}
"""Kinds of text that end with the mark, and how a remark is written in them."""

_TAIL_BYTES = 256
_IN_TAIL = re.compile(KEY.encode() + rb'(?:: |": "|\0)([0-9a-f]{64})')
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
    if suffix not in _TEXTS:
        raise ValueError(f"a file {suffix} carries no mark: .json, .png, {', '.join(_TEXTS)}")
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
    if str(path).endswith(".parquet"):
        return _of_parquet(path)
    with open(path, "rb") as file:
        file.seek(0, 2)
        file.seek(max(0, file.tell() - _TAIL_BYTES))
        found = _IN_TAIL.findall(file.read())
    return found[-1].decode() if found else ""


def _of_parquet(path: str | Path) -> str:
    try:
        metadata = pq.read_metadata(path).metadata or {}
    except pa.ArrowInvalid:
        return ""
    mark: bytes = metadata.get(KEY.encode(), b"")
    return mark.decode()
