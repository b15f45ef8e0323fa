"""The page of a study of trunk loads."""

from collections.abc import Mapping

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables
from spinepipe.schema import Table
from spinepipe.studies.trunk_loads.conclusions import conclusions
from spinepipe.studies.trunk_loads.conclusions_of_lifts import of_lifts
from spinepipe.studies.trunk_loads.lift_rows import lifts_of
from spinepipe.studies.trunk_loads.scenes import trunk_scenes
from spinepipe.studies.trunk_loads.scenes_of_lifts import lift_scenes
from spinepipe.studies.trunk_loads.selection import of_person, shown_person, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads, reproduces
from spinepipe.studies.trunk_loads.tables import (
    DRIVERS,
    INTERVALS,
    LEVELS_TABLE,
    PER_LIFT,
    PRESSURES,
    REMARKS,
    SIMPLIFIED,
    TASKS,
    TUNING,
)

SHOWN: Mapping[Table, tuple[str, str]] = {
    TASKS: (
        "Loads by body and task",
        "specimen task l4l5_compression_n l4l5_pressure_mpa l4l5_shear_n l5s1_compression_n "
        "l5s1_shear_n least_stress_mpa strength_used inside_eq_6 stable status message",
    ),
    PRESSURES: (
        "Computed and measured pressures",
        "tier task measured_mpa measured_status computed_mpa counted status",
    ),
    TUNING: (
        "What was fitted to measured pressures",
        "tier left_out parameter value default low high identifiable",
    ),
    INTERVALS: (
        "Intervals of loads",
        "specimen task quantity nominal low median high n_samples n_above n_failed",
    ),
    DRIVERS: (
        "Shares of the spread by input",
        "task quantity factor total total_low total_high message",
    ),
    LEVELS_TABLE: (
        "Load on every joint",
        "task level compression_n shear_anterior_n shear_right_n status",
    ),
    SIMPLIFIED: (
        "What simplifications change",
        "specimen task simplification l4l5_compression_n imbalance_nm status",
    ),
    REMARKS: ("What was put right, added or assumed in the geometry", "remark"),
}
"""Tables of the page with their titles and the columns that a reader compares."""

READ = (
    *(table.name for table in SHOWN),
    *(table.name for table in PER_LIFT),
    *("muscles", "upright", "design", "responses", "paths", "against_ghezelbash_2016"),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""


def page(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    lifts = bool(lifts_of(results.tables))
    tasked = not lifts or "tasks" in cohort.further
    told = list(conclusions(study, cohort, results)) if tasked else []
    scenes = trunk_scenes(cohort, results.table("paths"), results.table("levels"))
    return Page(
        conclusions=[*told, *of_lifts(study, cohort, results.tables, alone=not tasked)],
        sentences=sentences_of(__package__),
        key_figure="pressure_against_measured" if tasked else "lift_loads",
        tables=list(_tables(study, results)),
        left_out=(
            *left_out(study),
            *papers.left_out("Ghezelbash et al. 2016", reproduces(cohort.name)),
        ),
        scenes=[*scenes, *lift_scenes(results.tables)],
        chooser="Specimen" if tasked else "Lift",
    )


def _tables(study: TrunkLoads, results: ResultTables) -> list[Sortable]:
    """Tables that have rows; of levels those of one body, of remarks each once."""
    tasks = results.table("tasks")
    body = shown_person(study, tasks[sound(tasks)]) if len(tasks) else None
    found: list[Sortable] = []
    for shape, (title, names) in SHOWN.items():
        rows = results.table(shape.name)
        if shape is LEVELS_TABLE:
            rows = of_person(rows, body)
        elif shape is REMARKS and len(rows):
            rows = rows.drop_duplicates("remark")
        found += page_tables(shape, title, rows, names)
    return found


def left_out(study: TrunkLoads) -> tuple[str, ...]:
    """Parts that the settings leave out, each with the reason."""
    parts = []
    if not study.uncertain.tasks:
        parts.append("intervals, and which inputs make them (no task is to be sampled)")
    if study.volunteer is None:
        parts.append("agreement with measured pressures (nobody stands for the volunteer)")
    if not study.solving.strength:
        parts.append("strength left at every level (not asked for)")
    return tuple(parts)
