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
Cohorts whose truth is hidden, made by another simulator (tests/generators/hidden: rigid spine in
closed form held against OpenSim, laws of its own), searched with the rules a study has by default.
Formula: "same" where the library has the formula that was hidden, as
it is written, "other" where it only has others of the same physics. PART counts as named: its names
are right or wrong like those of NAMED. Top-1: exactly what is true and has a name is named. Wrong
name: any sure name that is not true, also beside a set. Above its limit: the design shows the
effect by algebra (centres need translations or preloads, stiffness that grows with compression two
preloads, differing levels several joints), spinepipe judges it testable, and the true gap is above
the one that spinepipe says it finds in nine cohorts of ten. What the oracle expects: the sum over
cohorts of the probability that noise leaves 3 of the log evidence by which the truth beats its best
rival on data without noise (oracle.py). Gaps are those truly there, in SD of one reading. Place:
the coordinate of the shape, and the joint if it is one. Intervals: Clopper-Pearson, of percentiles
by order statistics, of shares of what is expected by bootstrap, 95 %. Met: by the value. Reached:
by the whole interval. Each range of seeds is scored once (scored_seeds.csv); tuning uses others."""


def write(rows: Sequence[Row], command: str, code: str, folder: Path = RESULTS) -> None:
    """All tables as CSV, and the goals as Markdown too; ``code`` : digest that made the rows."""
    if not rows:
        print("discrepancy: no rows of this code", flush=True)
        return
    folder.mkdir(parents=True, exist_ok=True)
    scored = [judged(row) for row in rows if row["status"] == "scored" or _refused(row)]
    by_seed = {one.seed: one for one in scored}
    found = {
        "goals": pd.DataFrame(goals(scored)),
        "confusion": tables.confusion(scored),
        "by_effect": tables.by_effect(scored),
        "by_formula": tables.by_formula(scored),
        "by_design": tables.by_design(scored),
        "parameters": tables.parameters(scored),
        "sets": tables.sets(rows, by_seed),
    }
    for name, table in found.items():
        shown(table).to_csv(folder / f"discrepancy_{name}.csv", index=False)
    text = markdown(shown(found["goals"]), rows, command, code)
    (folder / "discrepancy.md").write_text(text, encoding="utf-8")
    print(text, flush=True)


def _refused(row: Row) -> bool:
    """A mistake in the files that is refused at the door is an answer."""
    return bool(row["status"] == "refused" and row["target"]["kind"] == "mistake")


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
