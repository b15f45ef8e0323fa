"""Tables of the scored cohorts in tests/validation/results."""

from collections import Counter
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import pandas as pd

from tests.validation.discrepancy import tables
from tests.validation.discrepancy.goals import goals
from tests.validation.discrepancy.judged import judged
from tests.validation.discrepancy.row import Row

RESULTS = Path(__file__).resolve().parents[1] / "results"

HEAD = """\
Cohorts whose truth is hidden, made by another simulator (tests/generators/hidden: OpenSim poses,
laws of its own), searched with the rules a study has by default but for 300 draws of the null.
Thresholds were tuned on other seeds. Top-1: exactly the truth is named. Wrong name: any name that
is not true. Intervals: Clopper-Pearson, of medians by order statistics, 95 %. Reached: by the
whole interval. Gaps are those truly there, in SD of one reading. The detection limit
(the gap at which an effect should be found in nine cohorts of ten) and "judged able" are
spinepipe's own; "by algebra" is not: centres need translations or preloads, stiffness that grows
with compression needs two preloads."""


def write(rows: Sequence[Row], command: str, code: str, folder: Path = RESULTS) -> None:
    """All tables as CSV, and the goals as Markdown too; ``code`` : digest that made the rows."""
    if not rows:
        print("discrepancy: no rows of this code", flush=True)
        return
    folder.mkdir(parents=True, exist_ok=True)
    scored = [judged(row) for row in rows if row["status"] == "scored"]
    by_seed = {one.seed: one for one in scored}
    found = {
        "goals": pd.DataFrame(goals(scored)),
        "confusion": tables.confusion(scored),
        "by_effect": tables.by_effect(scored),
        "parameters": tables.parameters(scored),
        "sets": tables.sets(rows, by_seed),
    }
    for name, table in found.items():
        shown(table).to_csv(folder / f"discrepancy_{name}.csv", index=False)
    text = markdown(shown(found["goals"]), rows, command, code)
    (folder / "discrepancy.md").write_text(text, encoding="utf-8")
    print(text, flush=True)


def shown(table: pd.DataFrame) -> pd.DataFrame:
    """Numbers to four figures; nothing where there is nothing."""
    return table.astype(object).map(_cell)


def _cell(cell: object) -> object:
    if cell is None or cell is pd.NA or (isinstance(cell, float) and cell != cell):
        return ""
    return f"{cell:.4g}" if isinstance(cell, float) else cell


def markdown(table: pd.DataFrame, rows: Sequence[Row], command: str, code: str) -> str:
    """The goals with what was scored, by which command and code, and when."""
    seeds = [row["target"]["seed"] for row in rows]
    status = Counter(row["status"] for row in rows)
    counts = ", ".join(f"{number} {name}" for name, number in status.most_common())
    lines = [
        "# Discrepancy",
        "",
        HEAD,
        "",
        f"{len(rows)} cohorts of seeds {min(seeds)} to {max(seeds)}: {counts}. "
        "Those without an answer are in discrepancy_sets.csv and count nowhere else.",
        "",
        f"`{command}`, code {code}, {date.today().isoformat()}",
        "",
        "| " + " | ".join(table.columns) + " |",
        "|" + "---|" * len(table.columns),
        *("| " + " | ".join(map(str, row)) + " |" for row in table.itertuples(index=False)),
        "",
    ]
    return "\n".join(lines)
