"""The marks of a result file: what it hangs on, and that it is as it was written.

Each file keeps two digests inside itself. ``result_digest`` is of all that it hangs on: code,
settings, data. ``content_digest`` is of its own bytes, these 64 digits left out; of JSON, whatever
its layout, of what it says. A file that was cut off or changed by as little as one bit no longer
fits its content digest, and counts as without any mark.

Parquet files hold them in their metadata, JSON files as their last keys, OpenSim's motions in their
header, all others at their end.
"""

import hashlib
import json
import re
import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from spinepipe.files import appearing

KEY = "result_digest"
"""Name of the digest of what a file hangs on, in every file."""

CONTENT = "content_digest"
"""Name of the digest of a file's bytes."""

_LENGTH = 64
BLANK = "0" * _LENGTH
"""Stands where the content digest will be."""

_TEXTS = {
    ".svg": "<!-- {} -->\n",
    ".pdf": "% {}\n",
    ".html": "<!-- {} -->\n",
    ".osim": "<!-- {} -->\n",
    ".yaml": "# {}\n",
    ".csv": "# {}\n",
}
"""Kinds of text that end with the marks, and how a remark is written in them."""

_TAIL_BYTES = 512
_CONTENT, _KEY = CONTENT.encode(), KEY.encode()
_AT_END = re.compile(
    _CONTENT
    + rb": ([0-9a-f]{64})(?: -->\n<!-- |\n# |\n% )"
    + _KEY
    + rb": ([0-9a-f]{64})(?: -->\n|\n)\Z"
)
_BEFORE_END_OF_PNG = re.compile(
    _CONTENT + rb"\0([0-9a-f]{64}.{4}).{4}tEXt" + _KEY + rb"\0([0-9a-f]{64}).{4}\0{4}IEND.{4}\Z",
    re.DOTALL,
)
"""The content digest goes together with the checksum of its chunk, which hangs on it."""

_PNG = ".png"
_PNG_END = b"IEND"
_PNG_FIELD_BYTES = 4

_MOTION = ".mot"
_HEAD_END = b"endheader\n"
_HEAD_BYTES = 4096
_IN_HEAD = re.compile(
    rb"\n" + _CONTENT + rb"=([0-9a-f]{64})\n" + _KEY + rb"=([0-9a-f]{64})\nendheader\n"
)

_PARQUET = b"PAR1"
_PARQUET_END_BYTES = 8
_IN_FOOTER = {name: re.compile(name + rb"\x18\x40([0-9a-f]{64})") for name in (_CONTENT, _KEY)}
"""The marks in the compact form of Thrift: next field, text of 64 bytes."""

_PIECE_BYTES = 1 << 22


class DamagedFile(ValueError):
    """A result file that is not as it was written; the text names it and says what to do."""

    def __init__(self, path: str | Path, why: str) -> None:
        super().__init__(
            f"{path} is damaged ({why}). It counts as lost: run again and it is computed anew"
        )


@dataclass(frozen=True)
class _Marks:
    """What a file says of itself: its marks, and from where to where the content digest stands."""

    mark: str
    content: str
    start: int
    end: int


def marked(content: str | bytes, suffix: str, digest: str) -> bytes:
    """Content of a text or picture with its marks; without a digest as it is.

    Raises
    ------
    ValueError
        For a kind of file that cannot carry one.
    """
    raw = content.encode() if isinstance(content, str) else content
    if not digest:
        return raw
    assert len(digest) == _LENGTH
    if suffix == _PNG:
        whole = sealed(_with_chunk(_with_chunk(raw, CONTENT, BLANK), KEY, digest), _PNG)
        found = _marks_in(BytesIO(whole), _PNG)
        assert found is not None
        # the content digest is part of a chunk, whose checksum (CRC-32) is another one with it
        checksum = _chunk(CONTENT, found.content)[-_PNG_FIELD_BYTES:]
        return whole[: found.start + _LENGTH] + checksum + whole[found.end :]
    if suffix == _MOTION:
        lines = f"{CONTENT}={BLANK}\n{KEY}={digest}\n".encode()
        return sealed(raw.replace(_HEAD_END, lines + _HEAD_END, 1), suffix)
    if suffix not in _TEXTS:
        able = ".json", _PNG, _MOTION, *_TEXTS
        raise ValueError(f"a file {suffix} carries no mark: {', '.join(able)}")
    marks = ((CONTENT, BLANK), (KEY, digest))
    remarks = (_TEXTS[suffix].format(f"{name}: {of}") for name, of in marks)
    return sealed(raw + "".join(remarks).encode(), suffix)


def sealed(raw: Any, suffix: str) -> bytes:
    """Bytes (or a buffer) of a file whose content digest is blank, with that digest."""
    file = BytesIO(raw)
    found = _marks_in(file, suffix)
    assert found is not None
    assert found.content == BLANK
    digest = _digest(file, found).encode()
    whole = file.getbuffer()
    whole[found.start : found.start + _LENGTH] = digest
    return file.getvalue()


def _with_chunk(raw: bytes, name: str, digest: str) -> bytes:
    """A picture with a text chunk before its last one."""
    end = raw.rindex(_PNG_END) - _PNG_FIELD_BYTES
    return raw[:end] + _chunk(name, digest) + raw[end:]


def _chunk(name: str, digest: str) -> bytes:
    chunk = f"tEXt{name}\0{digest}".encode()
    size = struct.pack(">I", len(chunk) - _PNG_FIELD_BYTES)
    return size + chunk + struct.pack(">I", zlib.crc32(chunk))


def write_marked(content: str | bytes, path: str | Path, digest: str) -> None:
    """Write a text or picture with its marks; it appears whole or not at all."""
    path = Path(path)
    raw = marked(content, path.suffix, digest)
    with appearing(path) as temporary:
        temporary.write_bytes(raw)


def with_mark(data: dict[str, Any], digest: str) -> dict[str, Any]:
    """Data of a JSON file with the marks as last keys."""
    return {**data, CONTENT: _said({**data, KEY: digest}), KEY: digest}


def without_mark(data: dict[str, Any]) -> dict[str, Any]:
    """Data of a JSON file without the marks."""
    return {key: value for key, value in data.items() if key not in (CONTENT, KEY)}


def read_json(path: str | Path) -> Any:
    """Data of a JSON file without its marks.

    Raises
    ------
    DamagedFile
        For a file that is no JSON, or has marks and is not as it was written.
    """
    try:
        data = json.loads(Path(path).read_bytes())
    except ValueError as trouble:
        raise DamagedFile(path, f"no JSON: {trouble}") from None
    if not isinstance(data, dict) or not {CONTENT, KEY} & data.keys():
        return data
    if not _mark_of_json(data):
        raise DamagedFile(path, "its content is not what its digest says")
    return without_mark(data)


def _said(data: dict[str, Any]) -> str:
    """The digest of what a JSON file says but for that digest."""
    plain = json.loads(json.dumps(data))
    text = json.dumps(plain, sort_keys=True, ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _mark_of_json(data: Any) -> str:
    if not isinstance(data, dict) or not isinstance(data.get(KEY), str):
        return ""
    others = {key: value for key, value in data.items() if key != CONTENT}
    mark: str = data[KEY]
    return mark if data.get(CONTENT) == _said(others) else ""


def read_mark(path: str | Path) -> str:
    """The mark of a file; empty for one that has none, or is not as it was written."""
    with open(path, "rb") as file:
        suffix = Path(path).suffix
        if suffix == ".json":
            try:
                return _mark_of_json(json.loads(file.read()))
            except (ValueError, RecursionError):
                return ""
        found = _marks_in(file, suffix)
        whole = found is not None and found.content == _digest(file, found)
    return found.mark if found is not None and whole else ""


def mark_in(path: str | Path) -> str | None:
    """The mark of a file as `read_mark` tells it; None where there is no file."""
    try:
        return read_mark(path)
    except FileNotFoundError:
        return None


def check_whole(path: str | Path, file: BinaryIO) -> None:
    """Refuse a file, open for reading, that has marks and is not as it was written.

    Raises
    ------
    DamagedFile
    """
    found = _marks_in(file, Path(path).suffix)
    if found is not None and found.content != _digest(file, found):
        raise DamagedFile(path, "its bytes are not those that were written")


def _marks_in(file: BinaryIO, suffix: str) -> _Marks | None:
    """The marks of a file that is no JSON; nothing of a file without them, or half a file."""
    if suffix == ".parquet":
        return _marks_of_parquet(file)
    if suffix == _MOTION:
        start, part, form = 0, _from(file, 0)[:_HEAD_BYTES], _IN_HEAD
    else:
        start = max(0, file.seek(0, 2) - _TAIL_BYTES)
        part, form = _from(file, start), _BEFORE_END_OF_PNG if suffix == _PNG else _AT_END
    found = form.search(part)
    if found is None:
        return None
    content = found[1][:_LENGTH].decode()
    return _Marks(found[2].decode(), content, start + found.start(1), start + found.end(1))


def _marks_of_parquet(file: BinaryIO) -> _Marks | None:
    """From the metadata; of thousands of files pyarrow would take ten times as long."""
    size = file.seek(0, 2)
    end = _from(file, max(0, size - _PARQUET_END_BYTES))
    if len(end) < _PARQUET_END_BYTES or not end.endswith(_PARQUET):
        return None
    start = size - struct.unpack("<I", end[: -len(_PARQUET)])[0] - _PARQUET_END_BYTES
    footer = _from(file, max(0, start))
    content, mark = (_IN_FOOTER[name].search(footer) for name in (_CONTENT, _KEY))
    if content is None and mark is None:
        return None
    told = mark[1].decode() if mark else ""
    if content is None:  # which therefore does not fit
        return _Marks(told, "", size, size)
    at = max(0, start) + content.start(1)
    return _Marks(told, content[1].decode(), at, at + _LENGTH)


def _from(file: BinaryIO, start: int) -> bytes:
    file.seek(start)
    return file.read()


def _digest(file: BinaryIO, marks: _Marks) -> str:
    """sha256 of all bytes but those of the content digest."""
    found = hashlib.sha256()
    # what is before it and what is behind it, some MB at a time
    file.seek(0)
    left = marks.start
    while left and (piece := file.read(min(left, _PIECE_BYTES))):
        left -= len(piece)
        found.update(piece)
    file.seek(marks.end)
    while piece := file.read(_PIECE_BYTES):
        found.update(piece)
    return found.hexdigest()
