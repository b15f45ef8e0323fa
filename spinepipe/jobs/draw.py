"""What the report of a study of any kind is made of, from its files."""

from collections.abc import Collection
from pathlib import Path

import pyarrow.parquet as pq

from spinepipe.report.page.document import Results
from spinepipe.tables import read_frames


def results_of(
    read: Collection[str], tables: list[str], figures: list[str], captions: list[str]
) -> Results:
    """Rows of the tables named in `read`, where all tables come from, pictures and captions."""
    return Results(
        tables=read_frames([path for path in tables if Path(path).stem in read]),
        metadata={Path(path).stem: _metadata(path) for path in tables},
        pictures=_texts(figures),
        captions=_texts(captions),
    )


def _metadata(path: str) -> dict[str, str]:
    found = pq.read_schema(path).metadata or {}
    return {key.decode(): value.decode() for key, value in found.items()}


def _texts(paths: list[str]) -> dict[str, str]:
    """Texts of files by the name of the file, in the order given."""
    return {Path(path).stem: Path(path).read_text(encoding="utf-8") for path in paths}
