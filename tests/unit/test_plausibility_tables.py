"""Tables of ranges, hypotheses and words: each row can be used, and the likeliest mistake is named.

Catches a row that nobody reads or that fails when it is said, and a scorer that leaves priors out.
"""

import re
from collections.abc import Callable
from math import pi
from pathlib import Path
from string import Formatter

import numpy as np
import pandas as pd
import pytest
from cohort_cases import text
from cohort_cases import write as write_small
from mistaken_cohorts import good, told
from sweeps import sweep

from spinepipe.cohort import read
from spinepipe.plausibility import score
from spinepipe.plausibility.score import (
    hypotheses,
    implausible,
    suspect,
    table,
    unit_of,
    usual,
)
from spinepipe.plausibility.warnings.readings import too_small
from spinepipe.plausibility.warnings.warning import PACKAGE

ROOT = Path(__file__).resolve().parents[2] / "spinepipe"
WARNINGS = table(PACKAGE, "warnings")
CHECKED = {row["quantity"] for row in table(PACKAGE, "columns")}


def code() -> str:
    return "\n".join(path.read_text("utf-8") for path in ROOT.rglob("*.py"))


def is_said(name: str, code: str) -> bool:
    """Whether code names a row, whole or with a part put in: f"{stem}_away"."""
    ends = re.findall(r'f"\{\w+\}(_\w+)"', code)
    starts = re.findall(r'f"(\w+_)\{\w+\}"', code)
    parts = name.endswith(tuple(ends)) or name.startswith(tuple(starts))
    return f'"{name}"' in code or parts or name in CHECKED


def test_every_row_is_read_and_has_what_it_needs() -> None:
    whole = code()
    for row in table(score.PACKAGE, "ranges"):
        limits = usual(row["quantity"])
        assert row["source"], row
        assert limits.low < limits.high, row
        assert limits.usual_low < limits.usual_high, row
        assert is_said(row["quantity"], whole), row
    for row in WARNINGS:
        assert is_said(row["warning"], whole), row
        assert row["found"], row
        assert row["allowed"], row
    known = {row["what"] for row in table(score.PACKAGE, "hypotheses")}
    assert not {name for name in known if not is_said(name, whole)}
    for one in (one for what in known for one in hypotheses(what)):
        names = {name for _, name, _, _ in Formatter().parse(one.remedy) if name}
        assert names <= {"words", "size", "factor", "columns", "what", "mended", "squared"}


@pytest.mark.parametrize(
    ("what", "value", "quantity", "words"),
    [
        ("length", 4.5, "markers_away", "in cm"),
        ("length", 1.1e-3, "spine_size", "in m"),
        ("length", 0.101, "spine_size", "in cm"),
        ("length", 0.0405, "spine_size", "in inches"),
        ("rotation", 0.115, "motion_over_expected", "moments in lbf in and not N m"),
        ("rotation", 1 / 57.0, "stiffness_over_published", "angles in radians and not degrees"),
        ("length", 3.3, "spine_size", None),
        ("length", 0.0, "spine_size", None),
    ],
)
def test_the_likeliest_mistake_is_named(
    what: str, value: float, quantity: str, words: str | None
) -> None:
    found = suspect(what, value, quantity)
    assert (found.words if found else None) == words


def test_a_rare_mistake_needs_better_numbers() -> None:
    """Between two units that both explain a number, what is more common is named."""
    middle = (8.85 * 57.2957795) ** -0.5  # as far from lbf in as from radians
    found = suspect("rotation", middle, "stiffness_over_published")
    assert found is not None
    assert found.words == "angles in radians and not degrees"


def lying(table: pd.DataFrame) -> None:
    """A spine scanned lying, its files in the axes of the table: line and axes still agree."""
    x, y = table["x_mm"].copy(), table["y_mm"].copy()
    turn = np.deg2rad(85.0)
    table["x_mm"], table["y_mm"] = (
        np.cos(turn) * x - np.sin(turn) * y,
        np.sin(turn) * x + np.cos(turn) * y,
    )
    table["extension_deg"] += 85.0


def light(table: pd.DataFrame) -> None:
    table.loc[0, "mass_kg"] = 1e-3


def unread(table: pd.DataFrame) -> None:
    table["left_rotation_deg"] = 0.0


@pytest.mark.parametrize(
    ("name", "file", "spoil", "column", "found"),
    [
        ("small_joints", "joints.csv", lying, "extension_deg", "turned by 8"),
        ("small", "bodies.csv", light, "mass_kg", "0.001 (L3)"),
        ("small", "motion.csv", unread, "left_rotation_deg", "0 in all"),
    ],
)
def test_what_no_mistake_of_the_lists_makes(
    name: str,
    file: str,
    spoil: Callable[[pd.DataFrame], None],
    column: str,
    found: str,
    tmp_path: Path,
) -> None:
    folder = good(name, tmp_path)
    rows = pd.read_csv(folder / file)
    numbers = rows.select_dtypes("number").columns.drop("step", errors="ignore")
    rows = rows.astype(dict.fromkeys(numbers, float))
    spoil(rows)
    rows.to_csv(folder / file, index=False)
    assert any(one.column == column and found in one.found for one in told(folder)), told(folder)


def test_readings_one_step_late_that_err(tmp_path: Path) -> None:
    """No reading is that of step 0 to the last digit, and steps follow the load before."""
    folder = good("fresh_directions", tmp_path)
    motion = pd.read_csv(folder / "motion.csv")
    cells = [name for name in motion if name.endswith(("_deg", "_mm"))]
    keys = [name for name in ("specimen", "test", "cycle", "joint") if name in motion]
    rng = np.random.default_rng(5)
    for _, rows in motion.groupby(keys, dropna=False, sort=False):
        order = rows.sort_values("step").index
        values = motion.loc[order, cells].to_numpy()
        late = np.vstack([values[:1] + rng.normal(0.0, 1e-3, values[:1].shape), values[:-1]])
        motion.loc[order, cells] = late
    motion.to_csv(folder / "motion.csv", index=False)
    found = [one for one in told(folder) if one.column == "step"]
    assert found
    assert all("load of the step before" in one.found for one in found)


def test_a_preload_far_from_its_vertebra(tmp_path: Path) -> None:
    head = "specimen,test,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm"
    rows = text("preload.csv", f"{head}\n*,*,L2,0,-400,0,0,0,0,400,59,0\n")
    (one,) = [p for p in told(write_small(tmp_path / "small", rows)) if "preload" in p.file]
    assert (one.column, one.remedy) == ("px_mm", "look for a misplaced point")
    assert one.allowed.endswith("at most 300 mm")


def test_moments_too_small_for_any_joint_to_be_judged(tmp_path: Path) -> None:
    folder = good("small", tmp_path)
    loads = pd.read_csv(folder / "loads.csv").astype({"mz_nm": float, "fy_n": float})
    loads["fy_n"] *= 0.0
    loads["mz_nm"] *= 5e-3
    loads.to_csv(folder / "loads.csv", index=False)
    (one,) = too_small(read(folder))
    assert (one.problem.row, one.problem.column) == (4, "mz_nm")
    assert one.problem.remedy == "suspected: kN m and not N m"


@sweep("slope", [0.2, 0.6, 1.0, 5.0, -3.0, None])
def test_motion_of_a_measured_size_is_left_alone(slope: float | None) -> None:
    """Motion against the load is another fault, and told elsewhere."""
    assert implausible(slope) == ""


@sweep(
    "factor, coordinate, words",
    [
        (pi / 180.0, "extension", "radians"),
        (180.0 / pi, "left_rotation", "degrees once more"),
        (1e-3, "right_bending", "N mm"),
        (1e-3, "anterior", "translations in m "),
        (1e3, "extension", "kN m and not N m"),
        (1.0 / 25.4, "superior", "inches"),
    ],
)
def test_a_unit_is_named_whatever_the_joints(factor: float, coordinate: str, words: str) -> None:
    """Joints are half as stiff as published, as stiff, and 1.8 times as stiff."""
    assert words in unit_of([factor / stiffer for stiffer in (0.6, 1.0, 1.8)], coordinate)


def test_a_fused_joint_is_no_unit() -> None:
    """It moves a tenth as far as expected, as moments in lbf in would have all joints do."""
    assert implausible(0.1) == "0.1 times the motion that published stiffness gives"
    assert unit_of([0.1, 0.9, 1.2], "extension") == ""
    assert "lbf in" in unit_of([0.1, 0.12, 0.14], "extension")


def test_no_unit_is_named_for_what_no_unit_makes() -> None:
    assert unit_of([0.045, 0.04], "extension") == ""
    assert unit_of([], "extension") == ""
