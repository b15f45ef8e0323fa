"""What holds for all tests."""

from collections.abc import Sequence

import pytest

LONG = ("workflow", "published")
"""Folders whose files take a minute and more: begun first, so that no core waits for the last."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files of `LONG` before all others; within a folder as collected."""
    items.sort(key=_place)


def _place(item: pytest.Item) -> int:
    parts: Sequence[str] = item.path.parts
    return 0 if any(folder in parts for folder in LONG) else 1
