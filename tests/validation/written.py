"""What a validation found, as files: CSV, and Markdown with the command and the date."""

from datetime import date
from pathlib import Path
from typing import Any

import pandas as pd

RESULTS = Path(__file__).parent / "results"


def write(name: str, head: str, rows: pd.DataFrame, command: str = "") -> None:
    """Write and print the table; the command is that of the part of this name unless told."""
    RESULTS.mkdir(exist_ok=True)
    shown = rows.map(lambda cell: f"{cell:.4g}" if isinstance(cell, float) else cell)
    shown.to_csv(RESULTS / f"{name}.csv", index=False)
    told = command or f"python -m tests.validation {name}"
    lines = [
        f"# {name.replace('_', ' ').capitalize()}",
        "",
        head,
        "",
        f"`{told}`, {date.today().isoformat()}",
        "",
        "| " + " | ".join(shown.columns) + " |",
        "|" + "---|" * len(shown.columns),
        *("| " + " | ".join(map(str, row)) + " |" for row in shown.itertuples(index=False)),
        "",
    ]
    (RESULTS / f"{name}.md").write_text("\n".join(lines), encoding="utf-8")
    print("\n".join(lines), flush=True)


def written(name: str) -> list[dict[str, Any]]:
    """Rows of a table as it was written last, cells as texts; none where there is no such table."""
    file = RESULTS / f"{name}.csv"
    if not file.exists():
        return []
    return pd.read_csv(file, dtype=str, keep_default_na=False).to_dict("records")
