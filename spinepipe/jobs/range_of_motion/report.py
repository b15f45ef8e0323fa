"""Job: the report of a range-of-motion study, one HTML file."""

from pathlib import Path

import pyarrow.parquet as pq

from spinepipe.files import appearing
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.report.page import Results
from spinepipe.report.range_of_motion.page import READ, range_of_motion_page
from spinepipe.studies import RangeOfMotion
from spinepipe.tables import read_frames


def run(
    root: str, study: str, tables: list[str], figures: list[str], captions: list[str], output: str
) -> None:
    """Write the page from the files of all tables, pictures (SVG) and captions."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    results = Results(
        tables=read_frames([path for path in tables if Path(path).stem in READ]),
        metadata={Path(path).stem: _metadata(path) for path in tables},
        pictures=_texts(figures),
        captions=_texts(captions),
    )
    page = range_of_motion_page(settings, cohort, results)
    with appearing(Path(output)) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _metadata(path: str) -> dict[str, str]:
    found = pq.read_schema(path).metadata or {}
    return {key.decode(): value.decode() for key, value in found.items()}


def _texts(paths: list[str]) -> dict[str, str]:
    """Texts of files by the name of the file, in the order given."""
    return {Path(path).stem: Path(path).read_text(encoding="utf-8") for path in paths}
