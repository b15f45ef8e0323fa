"""Whether result files say on which machine, in which folder and by whom they were made."""

import base64
import getpass
import gzip
import platform
import re
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

_EMBEDDED = re.compile(rb"base64,([A-Za-z0-9+/=]+)")
_PNG = b"\x89PNG\r\n\x1a\n"


def needles(project: Path) -> list[bytes]:
    """Paths and names that no result may hold; names of people are words of other texts too."""
    places = [project, Path(__file__).resolve().parents[2], Path(sys.prefix)]
    words = {str(place) for place in (*places, *(place.resolve() for place in places))} - {"/"}
    words |= {f"{Path.home()}/"}
    user, machine = getpass.getuser(), platform.node()
    words |= {f"{tempfile.gettempdir()}/", f"/{user}/", f"{user}@", f"@{machine}"}
    return sorted(word.encode() for word in words)


def told_of_the_machine(project: Path) -> list[str]:
    """``file: what`` of all that files below results say of this machine; logs left out."""
    results = project / "results"
    files = (path for path in results.rglob("*") if path.is_file() and "logs" not in path.parts)
    words = needles(project)
    return [
        f"{path.relative_to(results)}: {word.decode()}"
        for path in sorted(files)
        for word in words
        if any(word in part for part in parts_of(path.read_bytes()))
    ]


def parts_of(content: bytes) -> Iterator[bytes]:
    """All that a file says: its bytes, or what is in it where they are packed.

    In packed bytes a few letters in a row come by chance.
    """
    if content.startswith(b"PAR1"):
        yield from _of_parquet(content)
    elif content.startswith(_PNG):
        yield from _of_picture(content)
    elif content.startswith(b"\x1f\x8b"):
        yield from parts_of(gzip.decompress(content))
    elif content.startswith(b"PK\3\4"):
        with zipfile.ZipFile(BytesIO(content)) as file:
            for name in file.namelist():
                yield name.encode()
                yield from parts_of(file.read(name))
    else:
        yield content
        for found in _EMBEDDED.findall(content):
            yield from parts_of(base64.b64decode(found))


def _of_parquet(content: bytes) -> Iterator[bytes]:
    file = pq.ParquetFile(pa.BufferReader(content))
    yield str(file.metadata.created_by).encode()
    for key, value in (file.metadata.metadata or {}).items():
        yield key + b" " + value
    rows = file.read()
    for field, column in zip(rows.schema, rows.columns, strict=True):
        yield f"{field.name} {field.metadata}".encode()
        if pa.types.is_string(column.type):
            yield "\n".join(set(column.drop_null().to_pylist())).encode()


def _of_picture(content: bytes) -> Iterator[bytes]:
    """Chunks but those of the picture itself; texts that are packed are unpacked."""
    at = len(_PNG)
    while at < len(content):
        size, kind = int.from_bytes(content[at : at + 4]), content[at + 4 : at + 8]
        chunk = content[at + 8 : at + 8 + size]
        if kind == b"zTXt":
            yield zlib.decompress(chunk[chunk.index(b"\0") + 2 :])
        elif kind == b"iTXt" and chunk[chunk.index(b"\0") + 1]:
            yield zlib.decompress(chunk.split(b"\0", 5)[-1])
        elif kind != b"IDAT":
            yield chunk
        at += 12 + size
