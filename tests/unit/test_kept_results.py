"""Results that validation keeps hang on code that is there.

Catches validation that keeps results of code that is gone.
"""

import pytest

from tests.validation import findings
from tests.validation.made_by import made_by


@pytest.mark.parametrize("modules", [("fit",), ("pool",), findings.MODULES])
def test_what_kept_results_hang_on_is_found(modules: tuple[str, ...]) -> None:
    assert len(made_by(*modules)) == 12
