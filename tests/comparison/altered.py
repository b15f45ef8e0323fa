"""A change to a made-up run, as a row of data has it."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from papers.engine import value_of


def altered(
    tables: Mapping[str, pd.DataFrame], asked: Mapping[str, Any], changes: str
) -> tuple[dict[str, pd.DataFrame], dict[str, Any]]:
    """Copies of tables and settings with changes, which a bar parts from each other.

    ``table: only QUERY`` keeps rows, ``table: QUERY -> column = value`` fills them (all without a
    query; a value in brackets is computed from columns), ``study: name = value`` is a setting. A
    dash is an empty cell.
    """
    tables, asked = dict(tables), dict(asked)
    for change in filter(None, changes.split(" | ")):
        table, what = change.split(": ", 1)
        if table == "study":
            name, value = what.split(" = ")
            asked[name] = value_of(value)
            continue
        frame = tables[table].reset_index(drop=True)
        if what.startswith("only "):
            tables[table] = frame.query(what.removeprefix("only "))
            continue
        query, given = what.split("-> ", 1)
        column, value = given.split(" = ", 1)
        chosen = frame.query(query).index if query else frame.index
        to = frame.eval(f"new = {value}")["new"][chosen] if value[0] == "(" else value_of(value)
        filled = frame[column].astype(object)
        filled[chosen] = to
        numbers = pd.api.types.is_numeric_dtype(frame[column])
        tables[table] = frame.assign(**{column: pd.to_numeric(filled) if numbers else filled})
    return tables, asked
