"""Figure: growth of time and memory with joints, unknowns and targets, beside OpenSim."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from spinepipe.report.forms.chart import Chart, Key, Panel
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, FOURTH, MEASURED, MODEL, SOFT, THIRD, Look

Data = dict[str, Any]

_LOOKS: Mapping[str, Look] = {
    "spinepipe, among many": MODEL,
    "spinepipe, model loaded": THIRD,
    "OpenSim, static root-find": BASE,
    "OpenSim, CPodes, 1.5 s run": MEASURED,
    "OpenSim, default integrator (extrapolated)": SOFT,
    "cold": MODEL,
    "1 % lost": THIRD,
    "nothing to do": FOURTH,
}


def speed_chart(parts: dict[str, Data]) -> Chart:
    """Four panels from the parts' results."""
    growth = parts["many_spines"]["growth"]
    fits = [row for row in parts["foundation"]["engine"] if row["what"].startswith("calibration")]
    unknowns = [{**row, "unknowns": int(row["what"].split()[2])} for row in fits]
    targets = [
        {
            "targets": row["targets"],
            **{key: row[key]["wall_s"] for key in ("cold", "lost", "again")},
            "peak_mib": row["cold"]["peak_mib"],
        }
        for row in parts["sensitivity"]["targets"]
    ]
    one, five, time = "spinepipe, among many", "OpenSim, static root-find", "CPU time (s)"
    names = dict(
        zip(("together_s", "engine_s", "static_s", "cpodes_s", "default_s"), _LOOKS, strict=False)
    )
    kept = {"cold": "cold", "lost": "1 % lost", "again": "nothing to do"}
    panels = [
        _panel("One equilibrium", growth, "joints", names, time),
        _panel(
            "One calibration, T12–S1", unknowns, "unknowns", {"ours_s": one, "peer_s": five}, time
        ),
        _panel("A study of single targets, 2 cores", targets, "targets", kept, "wall time (s)"),
        _panel("Memory of it, cold", targets, "targets", {"peak_mib": "cold"}, "memory (MiB)"),
    ]
    keys = [Key(look, name) for name, look in _LOOKS.items()]
    return Chart("Speed beside OpenSim", panels, "Time and memory over size of task.", keys)


def _panel(title: str, rows: Sequence[Data], x: str, names: Mapping[str, str], label: str) -> Panel:
    cells = [(row[x], row[key], name) for key, name in names.items() for row in rows]
    frame = pd.DataFrame(cells, columns=["x", "y", "series"])
    return Curves(
        title=title,
        x_label=x,
        y_label=label,
        frame=frame,
        looks=_LOOKS,
        points=tuple(names.values()),
        x_log=True,
        y_log="memory" not in label,
        zeros=False,
        width=420.0,
    )
