"""Tidy tables of every kind of study: one unit a column, no star, no text that is data."""

from pathlib import Path

import pandas as pd
import pytest
from made_results import made

from spinepipe.studies.discrepancy.tables import GAP
from spinepipe.studies.registry import kind_names
from spinepipe.tables import to_arrow
from spinepipe.tidy.tables import _SLUGS, _mapping, tidied


@pytest.mark.parametrize("kind", kind_names())
def test_tidy_tables_of_a_kind(kind: str, tmp_path: Path) -> None:
    tables = made(kind, tmp_path).tables
    found = tidied(kind, tables)
    asked = {row["tidy"] for row in _mapping() if row["kind"] == kind}
    assert asked, kind
    assert found.keys() <= asked
    for name, (table, rows) in found.items():
        assert tuple(rows) == table.names
        assert "status" not in table.names[1:], name
        for column in table.columns:
            assert column.unit in _SLUGS, column
            assert not column.unit or column.name.endswith(_SLUGS[column.unit])
        text = rows.select_dtypes(exclude=["number", "bool"]).astype(str)
        assert not text.isin(["*"]).any().any()
        assert not text.apply(lambda of: of.str.startswith(("{", "["))).any().any()
        to_arrow(table, {one: rows[one] for one in table.names})  # keys are unique


def test_rows_that_differ_in_unit_fill_columns_of_their_own() -> None:
    head = dict.fromkeys(GAP.names) | {"specimen": "a", "test": "flexion", "joint": "L4L5"}
    rows = [
        head
        | {"step": 1, "coordinate": "extension", "unit": "deg", "load": 5.0}
        | {"measured": 3.0, "base": 2.0, "noise_sd": 0.1},
        head
        | {"step": 1, "coordinate": "anterior", "unit": "mm", "load": 7.0}
        | {"measured": 1.0, "base": 4.0, "noise_sd": 0.2},
    ]
    table, found = tidied("discrepancy", {GAP.name: pd.DataFrame(rows)})["readings"]
    assert found["measured_deg"].tolist()[0] == 3.0
    assert pd.isna(found["measured_deg"][1])
    assert found["residual_mm"].tolist()[1] == -3.0
    assert (found["load_nm"][0], found["load_n"][1]) == (5.0, 7.0)
    assert table.column("residual_mm").unit == "mm"
    assert table.key == ("specimen", "test", "step", "joint", "coordinate")
