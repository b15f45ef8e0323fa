"""Tables of the page in the field's units: what cells say, and where sides or joints are alike."""

import pandas as pd
import pytest
from discrepancy_cases import frames

from spinepipe.studies.discrepancy.field_tables import (
    formula_table,
    formula_text,
    numbers_table,
    per_degree,
    tabulated_table,
    withheld_table,
)
from spinepipe.studies.discrepancy.verdict import WithheldEffect
from spinepipe.studies.discrepancy.verdict_unnamed import Formula, FormulaTerm
from spinepipe.units import DEG_PER_RAD


def cells(rows: pd.DataFrame) -> dict[tuple[str, str], str]:
    """By number and unit, of the only joint."""
    shown, columns = numbers_table(rows)
    assert [column.name for column in columns] == ["motion", "number", "unit", "L4L5"]
    return {(row["number"], row["unit"]): row["L4L5"] for row in shown.to_dict("records")}


def test_a_number_is_told_with_its_interval_and_alike_sides_once() -> None:
    found = cells(frames("NAMED")["field_numbers"])
    assert found["stiffness at rest", "N m/°"] == "0.210 [0.160, 0.260]"
    assert found["stiffness at 5 N m, to either side", "N m/°"] == "1.00 [0.950, 1.05]"
    assert found["break, to either side", "°"] == "1.50 [1.45, 1.55]"
    assert found["loop area, between ±5 N m", "N m °"] == "4.00 [not known]"
    assert len(found) == 5


def test_sides_that_differ_are_named_as_motions() -> None:
    rows = frames("NAMED")["field_numbers"]
    rows.loc[rows["number"] == "stiffness_at_minus", "value"] = 0.6
    found = cells(rows)
    assert ("stiffness at 5 N m, flexion", "N m/°") in found
    assert ("stiffness at 5 N m, extension", "N m/°") in found


def test_joints_that_are_alike_share_a_column() -> None:
    rows = frames("NAMED")["field_numbers"]
    shown, columns = numbers_table(pd.concat([rows, rows.assign(joint="L3L4")]))
    assert columns[-1].name == "every joint"
    assert len(columns) == 4
    differ = pd.concat([rows, rows.assign(joint="L3L4", value=rows["value"] + 1.0)])
    assert [column.name for column in numbers_table(differ)[1]][3:] == ["L4L5", "L3L4"]
    assert len(shown) == 5


def test_a_tabulated_law_has_the_load_and_that_of_the_base() -> None:
    shown, _ = tabulated_table(frames("UNKNOWN")["tabulated"])
    row = shown.to_dict("records")[0]
    assert row["at"] == "\u22122.00 °"
    assert row["L3L4"].endswith(", base \u22125.00")


TERM = FormulaTerm(
    "*",
    "L4L5",
    "right_bending",
    "load",
    "extension^2",
    -138.0,
    4.6,
    "N m/rad^2",
    0.9,
    ("extension",) * 2,
)
FORMULA = Formula(
    (TERM,),
    "moment in right bending at L4L5 = -138 (SD 4.6) N m/rad^2 * extension^2",
    *(0.9, 0.8, 12.0),
)


def test_a_formula_is_told_by_degrees() -> None:
    assert per_degree(-138.0, "N m/rad^2") == (pytest.approx(-138.0 / DEG_PER_RAD**2), "N m/°²")
    assert per_degree(3.0, "N/(mm rad)") == (pytest.approx(3.0 / DEG_PER_RAD), "N/(mm °)")
    assert per_degree(3.0, "N m s/rad")[1] == "N m s/°"
    assert per_degree(2.0, "deg per test") == (2.0, "deg per test")
    told = formula_text(FORMULA)
    assert told.startswith("moment in lateral bending at L4L5 = ")
    assert told.endswith("(SD 0.0014) N m/°² × extension²")
    shown, _ = formula_table(FORMULA)
    (row,) = shown.to_dict("records")
    assert (row["place"], row["on"]) == ("L4L5", "load in lateral bending")
    assert row["unit"] == "N m/°²"


def test_what_an_imperfection_would_have_to_be_known_to() -> None:
    hidden = (
        WithheldEffect("joint_centre_offset", "joint_centre", 2.0, 0.5, "mm", 1.0, 9.0),
        WithheldEffect("load_offset", "load_gain", 0.02, None, "1", 1.0, 3.0),
    )
    first, second = withheld_table(hidden)[0].to_dict("records")
    assert (first["allowed"], first["would have to be known to"]) == ("2.0 mm", "0.50 mm")
    assert (second["allowed"], second["would have to be known to"]) == (
        "2.0 %",
        "this alone does not do",
    )
