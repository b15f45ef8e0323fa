"""What stands above and below the panels of sensitivity figures."""

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.report.discrepancy.words import capital
from spinepipe.report.global_sensitivity.measures import DONE
from spinepipe.report.global_sensitivity.panels import Panel
from spinepipe.report.global_sensitivity.words import OUTPUT, kind, where, whole
from spinepipe.report.sections import sections
from spinepipe.report.style import saying
from spinepipe.report.words import AXIS, count
from spinepipe.studies.global_sensitivity import DUMMY


def title(index: int, panel: Panel) -> str:
    """Letter, test and joint, and below them the output."""
    first = where(panel.test, panel.joint)
    second = f"{capital(kind(panel.output, panel.coordinate))}, {AXIS[panel.coordinate].lower()}"
    return f"{chr(ord('a') + index)}   " + "\n".join(part for part in (first, second) if part)


def sections_of(
    kept: Sequence[Panel], heights_mm: Mapping[str, float], key_mm: float
) -> tuple[list[Axes], Figure]:
    """Axes of the panels, each output in lines of its own and of its own height."""
    counts = {name: sum(panel.output == name for panel in kept) for name in OUTPUT}
    lines = [(n, heights_mm[name]) for name, n in counts.items() if n]
    parts, figure = sections(lines, key_mm)
    return [axis for part in parts for axis in part], figure


def no_index(rows: pd.DataFrame) -> Figure:
    """A figure that says why there is nothing to show."""
    why = rows.loc[rows["status"] != DONE, ["status", "message"]].drop_duplicates()
    said = [str(row.message or row.status).replace("_", " ") for row in why.itertuples()]
    reason = "; ".join(dict.fromkeys(said[:2])) or "there is no output"
    return saying(f"No index can be shown: {reason}.")


def told(kept: Sequence[Panel], found: Sequence[Panel], not_drawn: str) -> str:
    """Below the panels: runs, what is together, the dummy, and what is only in the table."""
    rows = pd.concat([panel.rows for panel in kept])
    parts = [_runs(rows), _together(kept), _dummy(rows), _more(kept, found), not_drawn]
    return "; ".join(part for part in parts if part) + "."


def _runs(rows: pd.DataFrame) -> str:
    least, most = int(rows["runs"].min()), int(rows["runs"].max())
    runs = count(most, "run") if least == most else f"{whole(least)} to {count(most, 'run')}"
    failed = int(rows["failed"].max())
    lost = f", at most {failed} failed" if failed else ", none failed"
    several = rows["specimen"].nunique() > 1
    return f"{runs}{' of each specimen' if several else ''}{lost}"


def _together(kept: Sequence[Panel]) -> str:
    if all(panel.places < 2 for panel in kept):
        return ""
    rows = pd.concat([panel.rows for panel in kept])
    specimens = rows["specimen"].nunique()
    what_of = "joints" if specimens == 1 else f"joints of {specimens} specimens"
    if set(rows["output"]) == {"stiffness"}:
        what_of = f"{specimens} specimens"
    return f"bars and lines: means over the {what_of}"


def _dummy(rows: pd.DataFrame) -> str:
    if DUMMY not in set(rows["factor"]):
        return "no dummy, so no noise floor"
    if rows["noise_floor"].fillna(0.0).max() <= 0.0:
        return "the dummy's index is exactly 0 in this design"
    return "grey names: above the noise floor in no panel"


def _more(kept: Sequence[Panel], found: Sequence[Panel]) -> str:
    there = {(panel.output, panel.test, panel.coordinate) for panel in kept}
    if len(there) == len(found):
        return ""
    return f"{len(there)} of {len(found)} outputs, the others are in the table"
