"""The page of a study of global sensitivity."""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables, sortable
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.conclusions import conclusions
from spinepipe.studies.global_sensitivity.outputs import DONE, factor_name
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import (
    BASE_MOTION,
    BASE_STIFFNESS,
    FAILED_RUNS,
    INDICES,
)

READ = (
    *("indices", "convergence", "base_stiffness", "base_motion", "failed_runs"),
    *("responses", "design"),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_SHOWN = (
    *("specimen", "output", "test", "joint", "coordinate", "index", "factor", "other"),
    *("estimate", "ci_low", "ci_high", "noise_floor", "negligible", "runs"),
)
"""Columns of indices that a reader compares; the file has all."""


def page(study: GlobalSensitivity, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows."""
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="factor_indices",
        tables=_tables(results),
        left_out=left_out(study),
    )


def left_out(study: GlobalSensitivity) -> tuple[str, ...]:
    """Parts that the settings leave out, each with the setting that does."""
    parts = (
        ("joint motion", "outputs: motion: []", bool(study.outputs.motion)),
        ("joint loads", "outputs: joint_load: []", bool(study.outputs.joint_load)),
        ("calibrated stiffness", "outputs: stiffness: false", study.outputs.stiffness),
        ("noise floor", "dummy: false", study.dummy),
        (
            "interactions of two factors",
            "design: second_order: false",
            study.design.method != "sobol" or study.design.second_order,
        ),
        ("all load steps but the largest", "steps: peak", study.steps == "all"),
    )
    return tuple(f"{part} ({setting})" for part, setting, done in parts if not done)


def _tables(results: ResultTables) -> list[Sortable]:
    """Indices, the largest first, and what they rest on."""
    indices = results.table("indices")
    found = []
    if len(indices):
        rows = indices[(indices["status"] == DONE) & (indices["factor"] != DUMMY)]
        rows = rows.sort_values(["index", "estimate"], ascending=[False, False], kind="stable")
        rows = rows.assign(**{name: rows[name].map(_name) for name in ("factor", "other")})
        columns = [INDICES.column(name) for name in _SHOWN]
        found.append(sortable(INDICES.name, "Indices", INDICES.about, rows, columns))
    motion, failed = results.table("base_motion"), results.table("failed_runs")
    if len(motion):
        motion = motion[motion["verdict"] != "not_measured"]
    if len(failed):
        failed = failed[failed["failed"] > 0]
    stiffness: pd.DataFrame = results.table("base_stiffness")
    found += page_tables(BASE_STIFFNESS, "Stiffness from which inputs start", stiffness)
    found += page_tables(BASE_MOTION, "Motion of the starting spine", motion)
    found += page_tables(FAILED_RUNS, "Where runs failed", failed)
    return [table for table in found if table.rows]


def _name(factor: str) -> str:
    return factor_name(factor) if factor else ""
