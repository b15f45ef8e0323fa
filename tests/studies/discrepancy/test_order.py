"""The order in which a cohort and a study list things says nothing: it changes no verdict.

Catches a search that goes through specimens, tests, rows or effects as the files list them.
"""

import json
from pathlib import Path

import pandas as pd
import pytest
import stiffening_chains

from spinepipe import cohort as cohorts
from spinepipe.studies.discrepancy.codec import encode
from spinepipe.studies.discrepancy.job import searched
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import plain_data

pytestmark = pytest.mark.slow

EFFECTS = ["nonlinear_stiffening", "neutral_zone"]


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
    found = searched(study, cohorts.read(folder), None, at_once)
    assert encode(found.verdict)  # can be kept
    return dict(json.loads(json.dumps(plain_data(found.verdict))))


def test_order_of_effects_tests_and_specimens_changes_no_verdict(tmp_path: Path) -> None:
    stiffening_chains.chains(tmp_path, {"c": 45.0, "a": 50.0}, ("left_lateral_bending",))
    folder = tmp_path / "config/cohorts/chains"
    first = verdict_of(folder, tmp_path, EFFECTS)
    assert first["verdict"] != "NULL"  # there is something that an order could change
    shuffled(folder, 1)
    assert verdict_of(folder, tmp_path, EFFECTS[::-1]) == first
