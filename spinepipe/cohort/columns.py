"""The CSV files of a cohort folder, as `forms.yaml` beside this file declares them."""

from pathlib import Path

from spinepipe.documents.form import read_forms

__all__ = ["COHORT_YAML", "TABLES"]

COHORT_YAML = "cohort.yaml"

TABLES = read_forms(Path(__file__).with_name("forms.yaml"))
"""Every CSV file that is read, by stem; other files in the folder are ignored."""
