"""The report of a range-of-motion study."""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, Picture
from spinepipe.report.page.results import Results
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.report.range_of_motion.findings import findings
from spinepipe.report.range_of_motion.panels import EVERY
from spinepipe.studies import RangeOfMotion
from spinepipe.tables import ROM_SUMMARY, ROM_VARIANCE, STIFFNESS_SETS, Table

QUESTION = (
    "How far do the joints of these spines move in tests, and does that hang on the spine, on "
    "where its joint frames are, or on the stiffness?"
)
TITLES = {"range_of_motion": "Range of motion", "rom_variance": "What motion hangs on"}
READ = ("rom_summary", "rom_variance", "stiffness_sets", "frames")
"""Tables whose rows the page needs; of the others it tells where they come from."""

OWN_POSE = 0
"""The pose with the cohort's own joint frames."""


def range_of_motion_page(study: RangeOfMotion, cohort: Cohort, results: Results) -> str:
    """The report as one HTML document that fetches nothing; the same results, the same bytes."""
    frames = results.table("frames")
    whole = Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=[
            Picture.of(name, TITLES[name], svg, " ".join(results.captions[name].split()))
            for name, svg in results.pictures.items()
        ],
        tables=[table for table in _tables(cohort, results) if table.rows],
        metadata=results.metadata,
        left_out=left_out(study),
        poses=frames[frames["pose"] > OWN_POSE] if len(frames) else frames,
        with_loads=study.virtual_tests is None,
    )
    return whole.html(study, cohort)


def left_out(study: RangeOfMotion) -> tuple[str, ...]:
    """Draws that the settings leave out, each with the setting that does."""
    parts = (
        ("drawn joint frames", f"poses: {study.poses}", study.n_poses > 1),
        ("drawn stiffness sets", "stiffness_sets: 1", study.stiffness_sets > 1),
    )
    return tuple(f"{part} ({setting})" for part, setting, drawn in parts if not drawn)


def _tables(cohort: Cohort, results: Results) -> Iterator[Sortable]:
    """Rows of the whole cohort, or of its only specimen; those of each specimen are in the file."""
    chosen = EVERY if len(cohort.specimen_names) > 1 else cohort.specimen_names[0]
    summary, variance = results.table("rom_summary"), results.table("rom_variance")
    shown: tuple[tuple[Table, str, bool], ...] = (
        (ROM_SUMMARY, "Range of motion", True),
        (ROM_VARIANCE, "Shares of variance", True),
        (STIFFNESS_SETS, "Stiffness sets", False),
    )
    rows = {ROM_SUMMARY.name: summary, ROM_VARIANCE.name: variance}
    for table, title, by_specimen in shown:
        frame = rows.get(table.name, results.table(table.name))
        if by_specimen:
            frame = frame[frame["specimen"] == chosen]
        yield sortable(table.name, title, table.about, frame, table.columns)
