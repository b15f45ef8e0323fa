"""Rows of a run's table of tests."""

from typing import Any

import pandas as pd

from spinepipe.comparison.run import NotComputed, Run


def tested(run: Run, test: str, **where: Any) -> pd.DataFrame:
    """Tests that have a result and whose name begins like this, in any case; at least one."""
    rows = run.rows("statistics", **where)
    rows = rows[rows["test"].str.lower().str.startswith(test)]
    done = rows.dropna(subset=["p"])
    if done.empty:
        messages = [str(text) for text in rows["message"].unique() if text]
        raise NotComputed("; ".join(["no such test has a result", *messages[:1]]))
    return done
