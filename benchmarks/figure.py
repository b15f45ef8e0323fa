"""Figure: growth of time and memory with joints, unknowns and targets, beside OpenSim."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.report.panels import log_ticks
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, SMALL_PT, VERMILLION, blank

Data = dict[str, Any]

_HEIGHT_MM = 130.0


def speed_figure(parts: dict[str, Data]) -> Figure:
    """Four panels from the parts' results."""
    figure = blank(_HEIGHT_MM)
    (joints, unknowns), (targets, memory) = figure.subplots(2, 2)
    _joints(joints, parts["many_spines"]["growth"])
    _unknowns(unknowns, parts["foundation"]["engine"])
    _targets(targets, parts["sensitivity"]["targets"])
    _memory(memory, parts["sensitivity"]["targets"], parts["memory"]["processes"])
    return figure


def _joints(axis: Axes, rows: Sequence[Data]) -> None:
    looks = (
        ("together_s", "spinepipe, among many", BLUE, "o", "-"),
        ("engine_s", "spinepipe, engine of record, model loaded", GREEN, "s", "-"),
        ("static_s", "OpenSim, static root-find", VERMILLION, "^", "-"),
        ("cpodes_s", "OpenSim, CPodes, 1.5 s run", BLACK, "v", "-"),
        ("default_s", "OpenSim, default integrator (extrapolated)", GREY, "D", "--"),
    )
    at = [row["joints"] for row in rows]
    for key, label, color, marker, line in looks:
        values = [row[key] for row in rows]
        face = "white" if line == "--" else color
        axis.plot(at, values, color=color, marker=marker, ls=line, ms=3.2, mfc=face, label=label)
    _finish(axis, "a  One equilibrium", "joints", "CPU time (s)", at)
    axis.set_ylim(top=axis.get_ylim()[1] * 3e3)


def _unknowns(axis: Axes, rows: Sequence[Data]) -> None:
    fits = [row for row in rows if row["what"].startswith("calibration")]
    at = [int(row["what"].split()[2]) for row in fits]
    ours, theirs = ([row[key] for row in fits] for key in ("ours_s", "peer_s"))
    axis.plot(at, ours, color=BLUE, marker="o", ms=3.2, label="spinepipe, exact derivatives")
    label = "OpenSim static root-find, differences"
    axis.plot(at, theirs, color=VERMILLION, marker="^", ms=3.2, label=label)
    _finish(axis, "b  One calibration, T12-S1", "stiffnesses that are fitted", "CPU time (s)", at)
    axis.set_ylim(top=axis.get_ylim()[1] * 4)


def _targets(axis: Axes, rows: Sequence[Data]) -> None:
    looks = (
        ("cold", "cold", BLUE, "o"),
        ("lost", "1 % lost", GREEN, "s"),
        ("again", "nothing to do", GREY, "D"),
    )
    at = [row["targets"] for row in rows]
    for key, label, color, marker in looks:
        values = [row[key]["wall_s"] for row in rows]
        axis.plot(at, values, color=color, marker=marker, ms=3.2, label=label)
    _finish(axis, "c  A study of single targets, 2 cores", "targets", "wall time (s)", at)


def _memory(axis: Axes, rows: Sequence[Data], processes: Sequence[Data]) -> None:
    at = [row["targets"] for row in rows]
    cold = [row["cold"]["peak_mib"] for row in rows]
    axis.plot(at, cold, color=BLUE, marker="o", ms=3.2, label="all processes of the study, cold")
    for one, color, line in zip(processes, (GREEN, VERMILLION), (":", "--"), strict=True):
        label = f"{one['what'].partition(':')[0]}: one process that solves T12-S1"
        axis.axhline(one["peak_mib"], color=color, ls=line, label=label)
    _finish(axis, "d  Memory of it", "targets", "largest memory (MiB)", at)
    axis.set_yscale("linear")
    axis.set_ylim(0.0, 1.5 * max(cold))


def _finish(axis: Axes, title: str, across: str, up: str, at: Sequence[float]) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    log_ticks(axis.xaxis, min(at), max(at), 5)
    axis.set_xlabel(across)
    axis.set_ylabel(up)
    axis.set_title(title)
    axis.tick_params(axis="y", length=2.5)
    axis.legend(loc="upper left", fontsize=SMALL_PT, labelspacing=0.3, borderaxespad=0.2)
