"""Wrong units and signs in files that are sound cell by cell: told, named, and nowhere else.

Catches a wrong unit or sign that goes unsaid, is told twice, or is told of good data.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import study_cases
from chain_cases import Chains
from cohort_cases import write as write_small
from cohort_edge_cases import A
from mistaken_cohorts import good, told

from tests.generators.hidden import Recipe, draw_hidden, make
from tests.generators.phantom import phantom
from tests.generators.phantom import write as write_phantom

SHIPPED = sorted((Path(__file__).resolve().parents[2] / "config/cohorts").iterdir())
ANGLES = ["extension_deg", "right_bending_deg", "left_rotation_deg"]
MILLIMETRES = ["anterior_mm", "superior_mm", "right_mm"]
MOMENTS = ["mx_nm", "my_nm", "mz_nm"]
FORCES = ["fx_n", "fy_n", "fz_n"]
POINTS = ["px_mm", "py_mm", "pz_mm"]
ANGLES_OF_TESTS = {"flexion": "extension_deg", "left_lateral_bending": "right_bending_deg"}


def change(folder: Path, file: str, columns: list[str], factor: float, **where: str) -> None:
    """Multiply columns of a file, of the rows that have these names."""
    table = pd.read_csv(folder / file)
    rows = np.ones(len(table), dtype=bool)
    for column, name in where.items():
        rows &= (table[column] == name).to_numpy()
    present = [column for column in columns if column in table]
    table = table.astype(dict.fromkeys(present, float))
    table.loc[rows, present] *= factor
    table.to_csv(folder / file, index=False)


@pytest.mark.parametrize(
    "folder",
    [
        pytest.param(path, id=path.name, marks=[pytest.mark.full] * ("_sd" in path.name))
        for path in SHIPPED
    ],
)
def test_nothing_is_told_of_what_comes_along(folder: Path) -> None:
    assert told(folder) == ()


@pytest.mark.full
def test_nothing_is_told_of_a_further_phantom(tmp_path: Path) -> None:
    write_phantom(phantom(3), tmp_path / "further")
    assert told(tmp_path / "further") == ()


@pytest.mark.parametrize(
    ("design", "effect"),
    [("two_shears", ""), pytest.param("directions", "hysteresis", marks=pytest.mark.full)],
)
def test_nothing_is_told_of_hidden_effects_and_forces(
    design: str, effect: str, tmp_path: Path
) -> None:
    """Made by OpenSim; stiffness is drawn from the whole published range."""
    recipe = Recipe(seed=2, design=design, peak_n=100.0, translations=True, cycles=1)
    hidden = (draw_hidden(effect, recipe),) if effect else ()
    make(replace(recipe, hidden=hidden, gap=4.0), tmp_path / "made")
    assert told(tmp_path / "made") == ()


def test_nothing_is_told_of_what_other_tests_are_made_with(tmp_path: Path) -> None:
    write_small(tmp_path / "small")
    study_cases.project(tmp_path / "pose", study_cases.Size())
    Chains({"a": A}).write(tmp_path / "chains")
    made = [tmp_path / "small", *tmp_path.glob("*/config/cohorts/*")]
    assert [len(told(folder)) for folder in made] == [0, 0, 0]


MISTAKES = [
    ("motion.csv", ANGLES, np.pi / 180.0, "radians and not degrees (0.0175)", "extension_deg"),
    ("loads.csv", MOMENTS, 1e3, "N mm and not N m (0.001)", "mz_nm"),
    ("loads.csv", MOMENTS, 1.0 / 0.112985, "lbf in and not N m (0.113)", "mz_nm"),
    ("loads.csv", MOMENTS, 1e-3, "moments in kN m and not N m (1e+03)", "mz_nm"),
    ("motion.csv", ANGLES, 57.29578, "turned into degrees once more (57.3)", "extension_deg"),
]


@pytest.mark.parametrize(
    ("name", "file", "columns", "factor", "words", "column"),
    [
        *(("stiffening_spines", *mistake) for mistake in MISTAKES),
        ("t12s1_phantom", *MISTAKES[0]),
        ("linear_spines", *MISTAKES[1]),
    ],
)
def test_a_wrong_unit_is_told_once_for_each_column(
    name: str,
    file: str,
    columns: list[str],
    factor: float,
    words: str,
    column: str,
    tmp_path: Path,
) -> None:
    """Factors are those of the units: pi / 180 rad, 0.112985 N m in a lbf in, 1000 mm."""
    folder = good(name, tmp_path)
    for table, scaled in (("loads.csv", MOMENTS), ("motion.csv", ANGLES)):
        change(folder, table, scaled, 1.0 / 20.0)  # moments beyond 500 are refused as cells
    change(folder, file, columns, factor)
    found = told(folder)
    assert len(found) == 3
    assert {problem.column for problem in found} == set(columns)
    assert all(words in problem.remedy for problem in found)
    assert {problem.file for problem in found} == {f"{name}/{file}"}
    assert {problem.allowed[:14] for problem in found} == {"1/5 to 5 times"}
    first = next(problem for problem in found if problem.column == column)
    lines = (folder / file).read_text().splitlines()
    at = lines[0].split(",").index(column)
    assert first.row is not None
    assert float(lines[first.row - 1].split(",")[at]) != 0.0


@pytest.mark.parametrize(
    ("file", "columns", "factor", "words"),
    [
        ("motion.csv", MILLIMETRES, 1e-3, "translations in m and not mm (0.001)"),
        ("loads.csv", FORCES, 1e-3, "forces in kN"),
        ("loads.csv", POINTS, 1e-3, "points in m and not mm"),
        ("loads.csv", POINTS, 1e-1, "points in cm and not mm"),
        ("landmarks.csv", ["x_mm", "y_mm", "z_mm"], 1e-1, "lengths in cm and not mm (0.1)"),
        ("landmarks.csv", ["x_mm", "y_mm", "z_mm"], 1 / 25.4, "lengths in inches"),
    ],
)
def test_lengths_and_forces(
    file: str, columns: list[str], factor: float, words: str, tmp_path: Path
) -> None:
    folder = good("palanca_l1l4", tmp_path)
    change(folder, file, columns, factor)
    found = told(folder)
    assert any(words in problem.remedy for problem in found)
    assert {problem.file for problem in found} <= {
        f"palanca_l1l4/{file}",
        "palanca_l1l4/motion.csv",
    }


def test_one_test_of_one_specimen(tmp_path: Path) -> None:
    folder = good("t12s1_phantom", tmp_path)
    change(folder, "motion.csv", ANGLES, np.pi / 180.0, specimen="s02", test="flexion")
    (problem,) = told(folder)
    assert problem.column == "extension_deg"
    assert problem.found.endswith("(s02, test flexion)")
    assert "radians" in problem.remedy
    row = (folder / "motion.csv").read_text().splitlines()[(problem.row or 0) - 1]
    assert row.startswith("s02,flexion")


def test_a_fused_joint_is_no_unit(tmp_path: Path) -> None:
    folder = good("t12s1_phantom", tmp_path)
    change(folder, "motion.csv", ANGLES, 0.05, joint="L3L4")
    assert told(folder) == ()


@pytest.mark.parametrize(
    "test", ["flexion", pytest.param("left_lateral_bending", marks=pytest.mark.full)]
)
def test_signs_of_a_joint_and_of_a_test(test: str, tmp_path: Path) -> None:
    folder = good("t12s1_phantom", tmp_path)
    column = ANGLES_OF_TESTS[test]
    change(folder, "motion.csv", [column], -1.0, specimen="s01", test=test, joint="L2L3")
    (problem,) = told(folder)
    assert problem.found == f"{column} of L2L3 against the load (s01, test {test})"
    assert problem.remedy.startswith(f"suspected: the sign of {column}")
    whole = good("t12s1_phantom", tmp_path / "whole")
    change(whole, "loads.csv", MOMENTS, -1.0, test=test)
    (problem,) = told(whole)
    assert problem.found == f"{column} of all joints against the load (all specimens, test {test})"
    assert "in t12s1_phantom/loads.csv" in problem.remedy


def test_a_joint_that_only_trembles_tells_no_sign(tmp_path: Path) -> None:
    """Ten times less than the SD of a reading, and against the load."""
    folder = good("t12s1_phantom", tmp_path)
    change(folder, "motion.csv", ANGLES, -1e-3, joint="L2L3")
    assert told(folder) == ()
