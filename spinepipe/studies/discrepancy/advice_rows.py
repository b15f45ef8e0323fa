"""Advice as rows of its table, and as the file that a laboratory opens."""

import csv
import io
from collections.abc import Sequence
from typing import Any

from spinepipe.studies.discrepancy.design.advice import Advice
from spinepipe.studies.discrepancy.tables import NEXT_TESTS

Row = dict[str, Any]


def advice_rows(found: Sequence[Advice]) -> list[Row]:
    """One row per subject and run, in the order of the advice."""
    rows = [
        {
            "effect_or_pair": one.subject,
            "test": one.test,
            "cycles": one.cycles,
            "gain_in_log_evidence": one.gain,
            "gain_per_cycle": one.per_cycle,
            "status": one.status,
            "message": one.message,
        }
        for one in found
    ]
    return list({(row["effect_or_pair"], row["test"]): row for row in reversed(rows)}.values())[
        ::-1
    ]


def advice_csv(rows: Sequence[Row]) -> str:
    """The rows as comma-separated text under the names of the table's columns."""
    content = io.StringIO()
    names = [column.name for column in NEXT_TESTS.columns]
    writer = csv.DictWriter(content, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _short(row[name]) for name in names})
    return content.getvalue()


def _short(value: Any) -> Any:
    """Numbers to what anybody reads; empty where there is none."""
    return f"{value:.4g}" if isinstance(value, float) else value
