"""The order in which a cohort and a study list things says nothing: it changes no verdict.

Catches a search that goes through specimens, tests, rows or effects as the files list them.
"""

import json
from pathlib import Path

import chain_cases as cases
import numpy as np
import pandas as pd
import pytest

from spinepipe import cohort as cohorts
from spinepipe.studies.discrepancy.codec import encode
from spinepipe.studies.discrepancy.job import searched
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import plain_data

pytestmark = pytest.mark.slow

EFFECTS = ["nonlinear_stiffening", "neutral_zone"]
STIFFNESS = {"c": 45.0, "a": 50.0}
SIGN = {"flexion": -1.0, "extension": 1.0}
RISE = 4000.0
"""N m/rad3."""


def turned(moment: float, k: float) -> float:
    """Degrees at which k q + RISE q^3 is the moment; the cubic has one real root."""
    roots = np.roots([RISE, 0.0, k, -moment])
    return float(np.rad2deg(roots[np.argmin(np.abs(roots.imag))].real))


def written(root: Path) -> Path:
    """Two stiffening chains in flexion, extension and bending; the folder of their cohort."""
    linear = {name: np.array([[k, 60.0, 200.0]] * 3) for name, k in STIFFNESS.items()}
    tests = ("flexion", "extension", "left_lateral_bending")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(cases.MOMENT_OF, "extension", ("mz_nm", 1.0, "extension"))
        made = cases.Chains(linear, tests, steps=6, step_nm=1.5, cycles=2, noise_deg=0.05)
    for row in made.motion.itertuples():
        if row.test in SIGN:
            moment, k = SIGN[row.test] * made.step_nm * row.step, STIFFNESS[row.specimen]
            made.motion.loc[row.Index, "extension_deg"] += turned(moment, k) - np.rad2deg(
                moment / k
            )
    made.write(root)
    return root / "config/cohorts/chains"


def shuffled(folder: Path, seed: int) -> None:
    """Rows of every file of a cohort in another order."""
    for path in sorted(folder.glob("*.csv")):
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
        rows.sample(frac=1.0, random_state=seed).to_csv(path, index=False)


def verdict_of(folder: Path, root: Path, effects: list[str]) -> dict[str, object]:
    study = Discrepancy.model_validate(
        {
            "study": "probe",
            "kind": "discrepancy",
            "cohort": "chains",
            "base": {"stiffness": "per_specimen"},
            "effects": effects,
            "bootstrap": 50,
        }
    )
    found = searched(study, cohorts.read(folder), str(root), at_once)
    assert encode(found.verdict)  # can be kept
    return dict(json.loads(json.dumps(plain_data(found.verdict))))


def test_order_of_effects_tests_and_specimens_changes_no_verdict(tmp_path: Path) -> None:
    folder = written(tmp_path)
    first = verdict_of(folder, tmp_path, EFFECTS)
    assert first["verdict"] != "NULL"  # there is something that an order could change
    shuffled(folder, 1)
    assert verdict_of(folder, tmp_path, EFFECTS[::-1]) == first
