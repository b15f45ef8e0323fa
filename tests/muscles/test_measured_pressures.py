"""Measured pressures: entered again."""

from spinepipe.facts import STATUSES
from spinepipe.muscles.measured_pressures import measured_pressures


def test_measured_pressures_by_task() -> None:
    """Entered again: MPa, and whether it may be used for acceptance."""
    found = {}
    for row in measured_pressures():
        if row.task is not None:
            found.setdefault(row.task, []).append((row.value, row.status))
    assert found == {
        1: [(0.50, "confirmed")],
        2: [(1.10, "confirmed"), (1.00, "confirmed")],
        3: [(1.80, "confirmed")],
        4: [(1.10, "confirmed"), (1.08, "confirmed")],
        5: [(1.60, "from_memory")],
        6: [(2.30, "confirmed")],
        8: [(1.00, "from_memory")],
        9: [(0.60, "confirmed"), (0.55, "derived")],
    }


def test_every_pressure_has_a_source_and_a_value_or_a_range() -> None:
    for pressure in measured_pressures():
        assert pressure.source
        assert pressure.status in STATUSES
        assert pressure.value is not None or (pressure.low or 0.0) < (pressure.high or 0.0)
