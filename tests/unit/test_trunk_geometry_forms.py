"""The forms of a cohort's own muscles fit the generic male and name what is wrong.

Catches a muscle form that accepts what does not fit.
"""

from pathlib import Path

from installed import need_male
from sweeps import sweep

from spinepipe.documents.csv_table import read_table
from spinepipe.studies.trunk_loads.forms import (
    GEOMETRY_FORMS,
    MUSCLE_PARAMETERS,
    MUSCLES,
)

HEADER = "muscle,point,body,x_mm,y_mm,z_mm\n"


@sweep("form", GEOMETRY_FORMS, lambda form: form.stem)
def test_the_generic_male_is_read_without_a_word(form) -> None:
    table, problems = read_table(need_male() / form.file, form, form.file)
    assert problems == []
    assert table is not None
    assert len(table) == {"muscles": 1406, "muscle_parameters": 392, "body_frames": 58}[form.stem]


@sweep(
    "row, column",
    [
        ("psoas,0,L3,1,2,", "z_mm"),
        ("psoas,0.5,L3,1,2,3", "point"),
        ("psoas,0,,1,2,3", "body"),
        ("psoas,0,L3,1,9000,3", "y_mm"),
    ],
)
def test_bad_points_are_named(tmp_path: Path, row: str, column: str) -> None:
    file = tmp_path / "muscles.csv"
    file.write_text(HEADER + row + "\n", encoding="utf-8")
    _, problems = read_table(file, MUSCLES, "muscles.csv")
    assert [(one.row, one.column) for one in problems] == [(2, column)]


def test_negative_sizes_are_named(tmp_path: Path) -> None:
    file = tmp_path / "muscle_parameters.csv"
    file.write_text(
        "muscle,group,side,pcsa_mm2,source_stress_mpa\npsoas,psoas,right,-3,0\n", encoding="utf-8"
    )
    _, problems = read_table(file, MUSCLE_PARAMETERS, "muscle_parameters.csv")
    assert [one.column for one in problems] == ["pcsa_mm2", "source_stress_mpa"]
