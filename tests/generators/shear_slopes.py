"""A cohort of single segments under shear, from two-phase slopes that somebody measured.

Motion follows the force along two straight lines, the first softer, with noise. The lines are read
from a table that is no part of the project: rows of a specimen, direction and rate with both slopes
(N/mm) and the break between them (mm).
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

FORCES_N = (25.0, 50.0, 75.0, 100.0, 150.0)
NOISE_MM = 0.02
RATES = ("1", "10")
"""mm/s; at 100 the first line holds what the rig's mass does."""

HEADER = """\
cohort: {name}
title: C6-C7 under shear, simulated from published two-phase slopes
source: slopes of force over displacement by segmented regression, of {count} segments
made_up: true
vertebrae: [C7, C6]
gravity: false
zeroed_at_step_0: true
measurement_sd: {{rotation_deg: 0.1, translation_mm: 0.05}}
accuracy: {{rotation_deg: 0.1, translation_mm: 0.05}}
"""
FORCE, MOMENT = ("fx_n", "fy_n", "fz_n"), ("mx_nm", "my_nm", "mz_nm")
LOADS = ("specimen", "test", "step", "vertebra", *FORCE, *MOMENT, "px_mm", "py_mm", "pz_mm")
PLACE = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")


def make(slopes: Path, folder: Path, most: int = 8) -> None:
    """Write the cohort of the first segments of a table of slopes."""
    with slopes.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["rate_mm_per_s"] in RATES]
    names = sorted({row["specimen"] for row in rows})[:most]
    rng = np.random.default_rng(1)
    tables: dict[str, list[Sequence[object]]] = {
        "specimens": [["specimen"], *([name] for name in names)],
        "joints": [("specimen", "joint", *PLACE), *([name, "C6C7", *[0] * 6] for name in names)],
        "loads": [LOADS],
        "motion": [["specimen", "test", "cycle", "step", "joint", "anterior_mm"]],
    }
    for row in (row for name in names for row in rows if row["specimen"] == name):
        sign = 1.0 if row["direction"] == "anterior" else -1.0
        soft, stiff = float(row["slope_1_n_per_mm"]), float(row["slope_2_n_per_mm"])
        far = abs(float(row["breakpoint_mm"]))
        test = f"{row['direction']}_{row['rate_mm_per_s']}"
        for step, force in enumerate((0.0, *FORCES_N)):
            more = max(force - soft * far, 0.0)
            moved = sign * ((force - more) / soft + more / stiff) + rng.normal(0.0, NOISE_MM)
            place = row["specimen"], test
            tables["loads"].append([*place, step, "C6", sign * force, *[0] * 8])
            tables["motion"].append([*place, 1, step, "C6C7", f"{moved if step else 0.0:.4f}"])
    folder.mkdir(parents=True)
    header = HEADER.format(name=folder.name, count=len(names))
    (folder / "cohort.yaml").write_text(header, encoding="utf-8")
    for name, written in tables.items():
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(written)
