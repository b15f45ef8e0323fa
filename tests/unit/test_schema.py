"""Rows of data become tables: groups, keys, what cells may hold; and lists that code owns too.

Catches a column that is not what its row says, a row that names no group, and values that a job may
write and its table does not allow, or the other way round.
"""

from pathlib import Path
from typing import get_args

import pytest
from sweeps import sweep

from spinepipe.effects import EffectKind, PlaceSpread
from spinepipe.effects.field_numbers import NUMBERS
from spinepipe.experiment.double_sigmoid import Zone
from spinepipe.motion.scaling import SEGMENTS
from spinepipe.muscles.task import Tone
from spinepipe.muscles.trunk import BODIES, LEVELS
from spinepipe.schema import Column, Table, read_tables
from spinepipe.status import Balanced, PrescribedStatus, Status
from spinepipe.studies.cohort_stiffness.claims import HOLDS
from spinepipe.studies.cohort_stiffness.settings import COVARIATES
from spinepipe.studies.registry import kind_of
from spinepipe.studies.scoliosis.population import PER_SEGMENT
from spinepipe.studies.scoliosis.settings import MODELS
from spinepipe.units import COORDINATES

HEAD = "table,column,type,unit,key,low,high,allowed,empty,meaning\n"
ROWS = f"""{HEAD}@end,{{}}_low_mm,number,mm,,0,,,,lower end of {{}}
@end,{{}}_high_mm,number,mm,,,9,,never read,
@ends,first,@end,,,,,,,the {{}}
sizes,,table,,,,,,,One row per person.
sizes,,note,,,,,,,Read it first.
sizes,specimen,@specimen,,key,,,,,
sizes,step,integer,,key,-1,1,,,load step
sizes,width,@end,,,,,,not seen,the width
sizes,,@ends,,,,,,,length
sizes,side,text,,,,,left|right|,,side
"""


def tables(path: Path, text: str) -> dict[str, Table]:
    (path / "tables.csv").write_text(text, "utf-8")
    return read_tables(path / "tables.csv")


def test_rows_are_columns_and_groups_are_filled_in(tmp_path: Path) -> None:
    (table,) = tables(tmp_path, ROWS).values()
    not_seen = {"nullable": True, "empty": "not seen"}
    assert table == Table(
        "sizes",
        "One row per person.",
        ("specimen", "step"),
        (
            Column("specimen", "text", "name of the specimen"),
            Column("step", "integer", "load step", low=-1, high=1),
            Column("width_low_mm", "number", "lower end of the width", "mm", low=0, **not_seen),
            Column(
                *("width_high_mm", "number", "the width", "mm"),
                **{"nullable": True, "high": 9, "empty": "never read"},
            ),
            Column("first_low_mm", "number", "lower end of the length", "mm", low=0),
            Column(
                *("first_high_mm", "number", "the length", "mm"),
                **{"nullable": True, "high": 9, "empty": "never read"},
            ),
            Column("side", "text", "side", allowed=("left", "right", "")),
        ),
        "Read it first.",
    )


@sweep("of", ["", "txt", "@end_of", "end"])
def test_a_type_that_is_none_is_told_with_its_place(of: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=rf"tables\.csv: sizes, side: .*'{of}'"):
        tables(tmp_path, ROWS.replace("side,text", f"side,{of}"))


@sweep(
    "kind, table, column, values",
    [
        ("range_of_motion", "range_of_motion", "status", Status),
        ("scoliosis", "positions", "status", PrescribedStatus),
        ("scoliosis", "variants", "status", (*PrescribedStatus, "singular")),
        ("scoliosis", "laws", "model", MODELS),
        ("scoliosis", "population", "quantity", PER_SEGMENT),
        ("trunk_loads", "tasks", "status", Balanced),
        ("trunk_loads", "tasks", "tone", get_args(Tone)),
        ("trunk_loads", "levels", "level", LEVELS),
        ("trunk_loads", "upright", "body", BODIES),
        ("tracking", "fits", "status", (*Status, "marker_off")),
        ("tracking", "sizes", "segment", SEGMENTS),
        ("discrepancy", "candidates", "kind", EffectKind),
        ("discrepancy", "candidates", "spread", PlaceSpread),
        ("discrepancy", "candidates", "status", (*Status, "not_testable")),
        ("discrepancy", "field_numbers", "number", NUMBERS),
        ("discrepancy", "gap", "coordinate", COORDINATES),
        ("cohort_stiffness", "findings", "holds", HOLDS),
        ("cohort_stiffness", "covariates", "covariate", COVARIATES),
        ("cohort_stiffness", "load_displacement", "neutral_zone", Zone),
    ],
)
def test_tables_allow_what_the_code_has_for_it(kind, table, column, values) -> None:
    assert kind_of(kind).table(table).column(column).allowed == tuple(values)
