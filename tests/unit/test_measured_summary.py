"""`spinepipe show`: the rows that sum up what was measured, against the cohort's own tables."""

from dataclasses import replace
from pathlib import Path

import spinepipe as sp
from spinepipe.report.measured_summary import measured_summary

ROOT = Path(__file__).parents[2]


def test_each_row_is_of_its_specimen_test_and_joint() -> None:
    """Nine readings of three cycles of one test; SDs of cycles and ends by pandas."""
    cohort = sp.read_cohort(ROOT / "config" / "cohorts" / "stiffening_spines")
    rows = measured_summary(cohort)
    keys = ["specimen", "test", "joint"]
    assert not rows.duplicated(keys).any()
    assert set(rows["specimen"]) == set(cohort.specimen_names)
    motion = cohort.motion
    assert motion is not None
    for row in rows.to_dict("records"):
        own = motion[(motion[keys] == [row[key] for key in keys]).all(axis=1)]
        read = own[f"{row['motion'].replace(' ', '_')}_deg"]
        low, high = min(read.min(), 0.0), max(read.max(), 0.0)
        assert row["range"] == f"{low:.3g} to {high:.3g} deg"
        assert row["cycles"] == own["cycle"].nunique()
        again = read.groupby(own["step"]).std().max()
        assert row["repeats_within"] == f"{again:.2g}"


def test_a_range_has_no_zero_that_was_not_read() -> None:
    """Of a rig that starts elsewhere, and whose motion was not zeroed."""
    cohort = sp.read_cohort(ROOT / "config" / "cohorts" / "stiffening_spines")
    assert cohort.motion is not None
    moved = cohort.motion.assign(extension_deg=cohort.motion["extension_deg"] + 30.0)
    rows = measured_summary(replace(cohort, motion=moved), ["flexion_extension"])
    row = rows.iloc[0]
    own = moved[(moved[["specimen", "test", "joint"]] == row.iloc[:3].tolist()).all(axis=1)]
    read = own["extension_deg"]
    assert read.min() > 0.0
    assert row["range"] == f"{read.min():.3g} to {read.max():.3g} deg"
