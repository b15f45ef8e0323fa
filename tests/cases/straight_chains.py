"""A small cohort study: straight chains in pure moments, whose stiffness is known."""

from pathlib import Path

import numpy as np
import pandas as pd

NAME = "straight"
SPECIMENS = {"a": 50.0, "b": 40.0, "c": 70.0}
JOINTS = ("L4L5", "L3L4")
ODD = "bending (left) 2 N·m, 50 %"
"""A name that labs may give a test, and that becomes the name of a folder."""

TESTS = {"flexion": ("mz_nm", -1.0, "extension_deg"), ODD: ("mx_nm", -1.0, "right_bending_deg")}
STUDY = f"""\
study: small
kind: cohort_stiffness
cohort: {NAME}
significance: 0.05
representations: [per_joint, partially_pooled]
"""


def write_cohort(folder: Path) -> None:
    """Straight chains in pure moments: each joint turns by moment over stiffness."""
    folder.mkdir(parents=True)
    (folder / "cohort.yaml").write_text(
        f"cohort: {folder.name}\ntitle: straight chains\nsource: written for the tests\n"
        "vertebrae: [L5, L4, L3]\ngravity: false\n"
        "measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1}\n"
    )
    (folder / "specimens.csv").write_text("\n".join(["specimen", *SPECIMENS]) + "\n")
    names = ("extension_deg", "right_bending_deg", "left_rotation_deg")
    loads, motion, joints = [], [], []
    for specimen, k in SPECIMENS.items():
        for level, joint in enumerate(JOINTS):
            place = {"x_mm": 0, "y_mm": 36 * level, "z_mm": 0, **dict.fromkeys(names, 0)}
            joints.append({"specimen": specimen, "joint": joint, **place})
        for test, (column, sign, driven) in TESTS.items():
            for step in range(3):
                key = {"specimen": specimen, "test": test, "step": step}
                moment = {**dict.fromkeys(("mx_nm", "my_nm", "mz_nm"), 0.0), column: sign * step}
                force = dict.fromkeys(("fx_n", "fy_n", "fz_n"), 0.0)
                loads.append({**key, "vertebra": "L3", **force, **moment})
                for joint in JOINTS:
                    turned = {**dict.fromkeys(names, 0.01), driven: np.rad2deg(sign * step / k)}
                    motion.append({**key, "joint": joint, **turned})
    for name, rows in (("loads", loads), ("motion", motion), ("joints", joints)):
        pd.DataFrame(rows).to_csv(folder / f"{name}.csv", index=False)
