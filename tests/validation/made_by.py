"""What a measured result hangs on: results are kept as long as this stays the same."""

import hashlib
from pathlib import Path

from spinepipe.jobs.code import code_digest

TESTS = Path(__file__).resolve().parents[1]
SOURCES = ("generators/phantom", "validation")


def made_by(*modules: str) -> str:
    """Digest of these modules of kind cohort_stiffness, of the generator and of the validation."""
    found = hashlib.sha256()
    for module in modules:
        found.update(code_digest(f"spinepipe.studies.cohort_stiffness.{module}").encode())
    for folder in SOURCES:
        for path in sorted((TESTS / folder).glob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()[:12]
