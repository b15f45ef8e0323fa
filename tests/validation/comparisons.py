"""How the numbers of papers stand to those of the studies that were run here, counted."""

from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[2]
LIMITS = ("two_sided", "chosen", "borrowed", "wide", "one_sided", "binary")
OTHERS = ("outside", "undecided", "circular", "recomputed", "contradicted", "not_computed")
"""Verdicts beside inside."""


def table(results: Path = ROOT / "results") -> pd.DataFrame:
    """One row per study and paper: rows, those inside by what that took, and the others."""
    return pd.DataFrame([_row(path) for path in sorted(results.glob("*/against_*.parquet"))])


def _row(path: Path) -> dict[str, object]:
    rows = pd.read_parquet(path, columns=["limit", "verdict"])
    inside = rows[rows["verdict"] == "inside"]
    return {
        "study": path.parent.name,
        "paper": path.stem.removeprefix("against_"),
        "rows": len(rows),
        "inside": len(inside),
        **{f"inside_{name}": int((inside["limit"] == name).sum()) for name in LIMITS},
        **{name: int((rows["verdict"] == name).sum()) for name in OTHERS},
    }
