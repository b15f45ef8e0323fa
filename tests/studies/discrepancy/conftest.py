"""What several tests of searches look at."""

from pathlib import Path

import pytest
from discrepancy_cases import project


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with a study; verdicts are written beside it, over one another."""
    return project(tmp_path_factory.mktemp("page"))
