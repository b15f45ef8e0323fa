"""One table and one figure of what all parts measured: `benchmarks/results/README.md`."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.figure import speed_chart

Data = dict[str, Any]

PARTS = (
    "foundation",
    "identification",
    "cohort",
    "whole_study",
    "discrepancy",
    "many_spines",
    "memory",
    "sensitivity",
    "trunk",
)
"""Parts whose figures are gathered."""

CORES = 2

_TEXT = """\
# Speed

Written by `make bench` from what each part measured; its own page says more. Equilibria and fits:
CPU seconds of one core, medians. Runs of a workflow: wall seconds on {cores} cores, memory of all
processes. *Extrapolated*: OpenSim's default integrator from the first 10 ms of a run, a study of
OpenSim's from the time of one equilibrium.

{table}

![Times of equilibria, calibrations and workflows, and memory](speed.png)

{machines}
"""


def write(folder: Path) -> None:
    """Gather the results that there are; each part must have been measured."""
    parts = {name: json.loads((folder / f"{name}.json").read_text()) for name in PARTS}
    lines = ["| what | spinepipe | peer | peer's | ratio | part |", "|---|---|---|---|---|---|"]
    lines += [*_equilibria(parts), *_calibrations(parts), *_throughput(parts), *_workflows(parts)]
    machines = [
        f"{name}: {', '.join(f'{key} {value}' for key, value in part['machine'].items())}  "
        for name, part in parts.items()
    ]
    text = _TEXT.format(cores=CORES, table="\n".join(lines), machines="\n".join(machines))
    (folder / "README.md").write_text(text, encoding="utf-8")
    chart = speed_chart(parts)
    (folder / "speed.svg").write_text(chart.svg(), encoding="utf-8")
    (folder / "speed.png").write_bytes(chart.picture("png"))
    print(text)


def _equilibria(parts: dict[str, Data]) -> Iterator[str]:
    for row in parts["foundation"]["engine"]:
        if row["what"].startswith("equilibrium"):
            yield _against(row, "foundation")
    for row in parts["many_spines"]["growth"]:
        what = f"equilibrium among many, {row['joints']} joints"
        for peer, key in _PEERS.items():
            yield _line(what, row["together_s"], peer, row[key], "many_spines")


_PEERS = {
    "OpenSim static root-find": "static_s",
    "OpenSim CPodes, 1.5 s run": "cpodes_s",
    "OpenSim default integrator, 1.5 s run (extrapolated)": "default_s",
}


def _calibrations(parts: dict[str, Data]) -> Iterator[str]:
    for row in parts["foundation"]["engine"]:
        if row["what"].startswith("calibration"):
            yield _against(row, "foundation")
    yield _against(parts["cohort"]["specimen"], "cohort")


def _throughput(parts: dict[str, Data]) -> Iterator[str]:
    """Equilibria of a whole study beside OpenSim's static root-find, one model built for all."""
    growth = {row["joints"]: row for row in parts["many_spines"]["growth"]}
    for row in parts["sensitivity"]["sobol"]:
        what = f"{row['responses']['what']} ({row['equilibria']:,} equilibria)"
        peer_s = row["equilibria"] * growth[row["joints"]]["static_s"] / CORES
        peer = "OpenSim static root-find (extrapolated)"
        yield _line(what, row["responses"]["wall_s"], peer, peer_s, "sensitivity")
    beside = parts["trunk"]["beside"]
    peer = "OpenSim static optimisation"
    for what, key in (("once", "ours_s"), ("wrapped and settled; OpenSim's once", "settled_s")):
        yield _line(
            f"muscle forces of a posture, {what}", beside[key], peer, beside["peer_s"], "trunk"
        )


def _workflows(parts: dict[str, Data]) -> Iterator[str]:
    for name, run in _runs(parts):
        goal = f" (goal {run['goal']})" if run["goal"] else ""
        took = f"{run['wall_s']:.1f} s, {run['peak_mib']:.0f} MiB"
        yield f"| {name}: {run['what']}{goal} | {took} | | | | {_link(name)} |"
    for one in parts["discrepancy"]["works"]:
        what = f"missing effects, {one['about']} (goal {one['goal']})"
        yield f"| {what} | {one['new_s']:.1f} s | | | | {_link('discrepancy')} |"
    ours, theirs = parts["memory"]["processes"]
    yield (
        f"| largest memory of a process that solves T12-S1 | {ours['peak_mib']:.0f} MiB | OpenSim "
        f"| {theirs['peak_mib']:.0f} MiB | {theirs['peak_mib'] / ours['peak_mib']:.1f} "
        f"| {_link('memory')} |"
    )


def _runs(parts: dict[str, Data]) -> Iterator[tuple[str, Data]]:
    """Every run of a workflow with its part."""
    for name in ("foundation", "whole_study", "cohort"):
        yield from ((name, run) for run in parts[name]["study"])
    yield from (("discrepancy", run) for run in parts["discrepancy"]["again"])
    sobol, targets = parts["sensitivity"]["sobol"], parts["sensitivity"]["targets"]
    for row in sobol:
        yield from (("sensitivity", row[key]) for key in ("responses", "indices", "rest"))
    for row in targets:
        yield from (("sensitivity", row[key]) for key in ("cold", "again", "lost"))


def _against(row: Data, part: str) -> str:
    note = f" ({row['note']})" if row["note"] else ""
    return _line(row["what"], row["ours_s"], f"{row['peer']}{note}", row["peer_s"], part)


def _line(what: str, ours_s: float, peer: str, peer_s: float, part: str) -> str:
    ratio = f"{peer_s / ours_s:,.3g}" if peer_s < 1e3 * ours_s else f"{peer_s / ours_s:,.0f}"
    return f"| {what} | {_time(ours_s)} | {peer} | {_time(peer_s)} | {ratio} | {_link(part)} |"


def _link(part: str) -> str:
    return f"[{part}]({part}.md)"


def _time(seconds: float) -> str:
    """Three digits in a unit that suits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:,.3g} {unit}" if seconds < 1e3 else f"{seconds:,.0f} s"
    return f"{seconds / 1e-6:.3g} us"
