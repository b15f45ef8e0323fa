"""Finding about bootstraps: how far fitted stiffness spreads, and how many fits were lost."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.bootstrap_rows import LOADING_NAMES
from spinepipe.report.page.results import Results
from spinepipe.report.words import number
from spinepipe.studies import JointPoseSensitivity

FEWEST_FOR_SPREAD = 3
"""Quartiles of fewer fits say nothing of a spread: those of a single one never differ."""

_WHAT = {"start_bootstrap": "over start values", "damping_bootstrap": "over damping"}


def bootstraps(study: JointPoseSensitivity, results: Results) -> str:
    """Spread of the widest direction by part and loading, then the fits without a stiffness."""
    rows, counts = results.table("summary"), results.table("counts")
    if rows.empty:
        return ""
    chosen = rows[
        rows["part"].isin(_WHAT) & (rows["dataset"] == "all") & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])  # fmt: skip
    parts = list(_widest(chosen))
    lead = "Middle half (IQR) of the fitted stiffness as a share of its median, widest direction"
    told = f"{lead}: {'; '.join(parts)}." if parts else ""
    return " ".join(words for words in (told, _lost(counts)) if words)


def _widest(chosen: pd.DataFrame) -> Iterator[str]:
    for part, rows in chosen.groupby("part", sort=False):
        if (rows["n"] < FEWEST_FOR_SPREAD).all():
            yield f"{_WHAT[str(part)]} not told, with fewer than {FEWEST_FOR_SPREAD} fits of a kind"
            continue
        told = [
            f"{_spread(fits)} {LOADING_NAMES[str(loading)]}"
            for loading, fits in rows.groupby("loading", sort=False)
        ]
        yield f"{_WHAT[str(part)]} {', '.join(told)}"


def _spread(fits: pd.DataFrame) -> str:
    enough = fits[fits["n"] >= FEWEST_FOR_SPREAD]
    if enough.empty:
        return f"fewer than {FEWEST_FOR_SPREAD} fits"
    share = 100.0 * float((enough["iqr"] / enough["median"]).max())
    return f"{'below 0.01' if share < 0.01 else number(share, 2)} %"


def _lost(counts: pd.DataFrame) -> str:
    """How many of how many fits ended without a stiffness."""
    if counts.empty:
        return ""
    parts = []
    for part, what in _WHAT.items():
        rows = counts[counts["part"] == part]
        fits, lost = int(rows["fits"].sum()), int((rows["fits"] - rows["solved"]).sum())
        if fits:
            told = f" ({', '.join(_where(rows))})" if lost else ""
            parts.append(f"{what} {lost} of {fits}{told}")
    return f"Fits lost, without a stiffness: {'; '.join(parts)}." if parts else ""


def _where(rows: pd.DataFrame) -> Iterator[str]:
    for loading, part in rows.groupby("loading", sort=False):
        lost = int((part["fits"] - part["solved"]).sum())
        if lost:
            yield f"{LOADING_NAMES[str(loading)]} {lost} of {int(part['fits'].sum())}"
