"""Cycles that end where they did not begin are told; and of cycles against their load the sign.

One joint, 0.6 deg per N m, in steps of 2.5 N m to both sides; what is added is a formula.
Catches lag or a first cycle taken for an open loop, and a wrong sign told as steps in reverse.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.problems import InputError
from spinepipe.studies.plausibility import suspicions

LOADS = 2.5 * np.array([0, 1, 2, 3, 2, 1, 0, -1, -2, -3, -2, -1, 0])
WAY = np.sign(np.diff(LOADS, prepend=0.0))
"""1 where the load rises; nothing at the start."""

PART = np.linspace(0.0, 1.0, len(LOADS))
"""Of the cycle that is over."""

Cycle = Callable[[int], np.ndarray]
"""(13,) deg, by number from 0."""


def told(folder: Path, angle: Cycle, count: int, loads: np.ndarray = LOADS) -> list[str]:
    folder.mkdir()
    (folder / "cohort.yaml").write_text(
        f"cohort: {folder.name}\ntitle: t\nsource: none\nvertebrae: [L5, L4]\ngravity: false\n"
        "zeroed_at_step_0: false\nmeasurement_sd: {rotation_deg: 0.02, translation_mm: 0.02}\n"
    )
    (folder / "specimens.csv").write_text("specimen\n001\n")
    head = "specimen,joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    (folder / "joints.csv").write_text(f"{head}\n001,L4L5,0,0,0,0,0,0\n")
    load, motion = [], []
    rng = np.random.default_rng(1)
    for cycle in range(count):
        noise = rng.normal(0.0, 0.02, len(loads))
        for step, (m, q) in enumerate(zip(loads, angle(cycle) + noise, strict=True)):
            key = f"001,bend,{cycle + 1},{step}"
            load.append(f"{key},L4,0,0,0,0,0,{m}")
            motion.append(f"{key},L4L5,{q:.4f}")
    names = "specimen,test,cycle,step"
    forces = "fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm"
    (folder / "loads.csv").write_text("\n".join([f"{names},vertebra,{forces}", *load]) + "\n")
    (folder / "motion.csv").write_text("\n".join([f"{names},joint,extension_deg", *motion]) + "\n")
    cohort = cohorts.read(folder)
    assert cohort.specimen_names == ("001",)  # digits are a name
    return [f"{one.name}: {one.problem.found}; {one.problem.remedy}" for one in suspicions(cohort)]


@sweep(
    "angle, count, is_open",
    [
        (lambda n: 0.6 * LOADS, 1, False),
        (lambda n: 0.6 * LOADS + 0.5 * PART, 1, True),
        (lambda n: 0.6 * LOADS - 0.5 * PART, 1, True),
        (lambda n: 0.6 * LOADS + 0.15 * PART, 1, False),  # 0.03 of 9 deg are allowed
        (lambda n: 0.6 * LOADS + 0.5 * (PART + n), 3, True),
        (lambda n: 0.6 * LOADS - 0.3 * WAY, 1, False),  # lag, from the middle of the loop
        (lambda n: 0.6 * LOADS - 0.3 * (WAY + (n > 0) * (PART == 0)), 3, False),
        # the first cycle alone
        (lambda n: 0.6 * LOADS + 0.5 * PART * (n == 0), 3, False),
        # as often to one side as to the other: no drift
        (lambda n: 0.6 * LOADS + 0.5 * PART * (-1) ** n, 5, False),
    ],
)
def test_open_loops(tmp_path: Path, angle: Cycle, count: int, is_open: bool) -> None:
    found = told(tmp_path / "loop", angle, count)
    assert [one.partition(":")[0] for one in found] == ["loop_open"] * is_open
    assert all("extension_deg of L4L5" in one for one in found)


def test_a_cycle_against_its_load_is_a_sign_and_not_steps_in_reverse(tmp_path: Path) -> None:
    """Read backwards, a cycle that is the same to both sides would be right too."""
    (found,) = told(tmp_path / "sign", lambda n: -0.6 * LOADS + 0.1 * WAY, 3)
    assert found.startswith("test_against_load")
    assert "sign of extension_deg" in found


def test_steps_in_reverse_where_a_sign_does_not_explain_them(tmp_path: Path) -> None:
    ramp = 2.5 * np.array([0, 3, 2, 1, 0, 0, 0, 0])
    (found,) = told(tmp_path / "ramp", lambda n: 0.6 * ramp[::-1], 1, ramp)
    assert found.startswith("steps_reversed")


def test_numbers_that_yaml_makes_of_names_are_asked_for_in_quotes(tmp_path: Path) -> None:
    told(tmp_path / "x", lambda n: 0.6 * LOADS, 1)
    header = tmp_path / "x" / "cohort.yaml"
    header.write_text(header.read_text().replace("title: t", "title: 12"))
    with pytest.raises(InputError, match=r"found 12; .*put it in quotes"):
        cohorts.read(tmp_path / "x")
