"""The report of a study of global sensitivity: its tables, and what its settings leave out."""

from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Document, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables, sortable
from spinepipe.report.words import fixed, number
from spinepipe.schema import Column
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY
from spinepipe.studies.global_sensitivity.figures.panels import (
    DONE,
    NAME,
    Measures,
    factor_name,
    leading,
    measures_of,
    outputs,
)
from spinepipe.studies.global_sensitivity.findings import RESTS_ON, findings, opening
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import (
    BASE_MOTION,
    BASE_STIFFNESS,
    FAILED_RUNS,
    INDICES,
)

QUESTION = (
    "Which uncertain inputs drive the results of this spine's simulations, how sure is that, and "
    "which inputs need not be known better?"
)

READ = ("indices", "convergence", *RESTS_ON)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_PLACE = ("specimen", "output", "test", "step", "joint", "coordinate")
_RANKS = ("first", "second", "third")


def document(study: GlobalSensitivity, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    return Document(
        question=QUESTION,
        findings=findings(study, cohort, results),
        pictures=list(results.pictures.values()),
        tables=shown_tables(cohort, results),
        metadata=results.metadata,
        left_out=left_out(study),
        headline=opening(study, cohort, results),
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


def shown_tables(cohort: Cohort, results: ResultTables) -> list[Sortable]:
    """Leading factors of every output, interactions, and the indices of what is drawn."""
    indices = results.table("indices")
    measures = measures_of(indices) if len(indices) else None
    every = list(_rests_on(results))
    if measures is not None:
        every = [
            *(_ranking(indices, measures), *_pairs(indices)),
            *(*every, _drawn(cohort, indices, measures)),
        ]
    return [table for table in every if table.rows]


def _rests_on(results: ResultTables) -> Iterator[Sortable]:
    """The spine that the indices were taken at, and the runs that they lack."""
    for title, shape in (
        ("Stiffness from which the factors start", BASE_STIFFNESS),
        ("Motion of the base beside what was measured", BASE_MOTION),
        ("Where runs failed", FAILED_RUNS),
    ):
        rows = results.table(shape.name)
        if shape is BASE_MOTION and len(rows):
            rows = rows[rows["verdict"] != "not_measured"]
        if shape is FAILED_RUNS and len(rows):
            rows = rows[rows["failed"] > 0]
        yield from page_tables(shape, title, rows)


def _ranking(indices: pd.DataFrame, measures: Measures) -> Sortable:
    """One row for each output."""
    rows = indices[(indices["index"] == measures.main) & (indices["status"] == DONE)]
    made = [
        dict(zip(_PLACE, place, strict=True)) | _first(part)
        for place, part in rows.groupby(list(_PLACE), sort=False, dropna=False)
    ]
    columns = [
        *(column for column in INDICES.columns if column.name in _PLACE),
        *(
            Column(name, "text", f"{name} factor, {NAME[measures.main]} [interval]")
            for name in _RANKS
        ),
        Column("not above the dummy", "integer", "factors whose index is not above the floor"),
        Column(
            "negligible",
            "integer",
            "factors whose ST has its interval below 1 %",
            nullable=True,
            empty="no ST",
        ),
    ]
    about = f"By {NAME[measures.main]}; one row for each output."
    return sortable(
        "indices", "Leading factors of every output", about, pd.DataFrame(made), columns
    )


def _first(part: pd.DataFrame) -> dict[str, object]:
    own = part[part["factor"] != DUMMY]
    ordered = own.sort_values("estimate", ascending=False, kind="stable").to_dict("records")
    told = dict.fromkeys(_RANKS, "") | {
        name: _told(row) for name, row in zip(_RANKS, ordered, strict=False)
    }
    below = sum(row["above_floor"] is not None and not row["above_floor"] for row in ordered)
    little = own["negligible"].dropna()
    negligible = int(little.sum()) if len(little) else None
    return {**told, "not above the dummy": below, "negligible": negligible}


def _told(row: Mapping[Hashable, Any]) -> str:
    say = number if row["index"] == "mu_star" else fixed
    told = f"{factor_name(str(row['factor']))} {say(row['estimate'])}"
    if pd.isna(row["ci_low"]):
        return told
    return f"{told} [{say(row['ci_low'])}, {say(row['ci_high'])}]"


def _pairs(indices: pd.DataFrame) -> Iterator[Sortable]:
    rows = indices[(indices["index"] == "S2") & (indices["status"] == DONE)]
    if len(rows):
        clear = rows[rows["ci_low"] > 0.0].sort_values("estimate", ascending=False, kind="stable")
        about = "S2 whose intervals lie above 0, the largest first; of many pairs chance alone "
        about += "lifts 1 in 40."
        columns = INDICES.columns
        yield sortable("indices", "Interactions of two factors", about, clear, columns)


_DRAWN = "Indices of the outputs in the figures"


def _drawn(cohort: Cohort, indices: pd.DataFrame, measures: Measures) -> Sortable:
    """Indices of the outputs that the figures are about, factors in their order."""
    found = outputs(cohort, indices, measures)
    if not found:  # too few samples: no index of any output
        return sortable("indices", _DRAWN, INDICES.about, indices[:0], INDICES.columns)
    rows = pd.concat([panel.rows for panel in found])
    order = {name: place for place, name in enumerate(leading(found, measures))}
    ranked = rows.assign(rank=rows["factor"].map(order)).sort_values("rank", kind="stable")
    return sortable("indices", _DRAWN, INDICES.about, ranked, INDICES.columns)
