"""What tests need that need not lie on this machine: skipped with a reason where it does not."""

from pathlib import Path

import pytest

MALE = Path(__file__).resolve().parents[3] / "shared" / "data" / "thoracolumbar_male"


def need_male() -> Path:
    """Folder of the generic male spine, or skip the test."""
    if not MALE.is_dir():
        pytest.skip("the data of the generic male spine do not lie beside this repository")
    return MALE
