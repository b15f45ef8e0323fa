"""`python -m benchmarks [PART ...] [options]`: measure, print, write results/PART.*."""

import argparse
import json
import os
import statistics
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import Any

from benchmarks import (
    cohort,
    commands,
    digests,
    discrepancy,
    engine,
    equilibria,
    films,
    identification,
    imports,
    lost_fits,
    machine_texts,
    many_spines,
    pages,
    parameters,
    real_geometry,
    recordings,
    sensitivity,
    study,
    summary,
    tracking,
    trunk,
    trunk_beside,
)
from benchmarks.memory import processes
from benchmarks.timing import machine

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Run the parts that are asked for, or all."""
    parts: dict[str, Callable[[], None]] = {
        "foundation": foundation,
        "identification": identification_parts,
        "imports": lambda: print(*imports.seconds(), sep="\n", flush=True),
        "lost_fits": lost_fits_parts,
        "whole_study": whole_study,
        "cohort": cohort_parts,
        "digests": lambda: print(digests.sizes(), flush=True),
        "discrepancy": lambda: discrepancy_parts(options.old, options.slopes),
        "films": films_part,
        "many_spines": many_spines_part,
        "memory": memory_part,
        "pages": lambda: print(*pages.opened(), sep="\n", flush=True),
        "machine_texts": machine_texts_part,
        "sensitivity": sensitivity_parts,
        "real_geometry": lambda: real_geometry_part(options.cohort),
        "recordings": recordings_part,
        "tracking": tracking_part,
        "trunk": trunk_part,
        "summary": lambda: summary.write(RESULTS),
    }
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "part",
        nargs="*",
        help=f"{', '.join(parts)}; or: commands OLD; equilibria OLD; trunk_beside OLD",
    )
    given = os.environ.get(real_geometry.COHORT_VARIABLE)
    parser.add_argument("--cohort", default=given, help="folder of a cohort, for real_geometry")
    older = "discrepancy: the commit beside which HEAD is measured"
    parser.add_argument("--old", default="HEAD~1", help=older)
    slopes = os.environ.get(discrepancy.SLOPES_VARIABLE)
    parser.add_argument("--slopes", default=slopes, help="file of slopes in shear, for discrepancy")
    options = parser.parse_args()
    if options.part[:1] == ["commands"]:
        commands_part(*options.part[1:])
        return
    if options.part[:1] == ["trunk_beside"]:
        trunk_beside_part(*options.part[1:])
        return
    if options.part[:1] == ["equilibria"]:
        equilibria_part(*options.part[1:])
        return
    for name in options.part or parts:
        if name not in parts:
            sys.exit(f"no benchmark {name!r}: {', '.join(parts)}")
        parts[name]()


def foundation() -> None:
    """Equilibrium, calibration and the whole study: one table of each kind."""
    about = _about()
    lines = _head("Speed", about)
    lines += [
        "",
        "| what | spinepipe ms | peer | peer ms | ratio | agreement |",
        "|---|---|---|---|---|---|",
    ]
    engine_rows = []
    for rows in (engine.equilibria(), parameters.calibrations()):
        for row in rows:
            engine_rows.append({**asdict(row), "ratio": row.ratio})
            peer = f"{row.peer} ({row.note})" if row.note else row.peer
            lines.append(
                f"| {row.what} | {1e3 * row.ours_s:.2f} | {peer} | {1e3 * row.peer_s:.4g} "
                f"| {row.ratio:.0f} | {row.agreement} |"
            )
            print(lines[-1], flush=True)
    study_rows = _study_rows(lines, study.runs())
    per_target = 1e3 * study_rows[0]["engine_s"] / study.targets()
    lines += ["", f"Snakemake's own CPU per target of the cold run: {per_target:.1f} ms (goal 7)."]
    print(lines[-1], flush=True)
    data = {"machine": about, "engine": engine_rows, "study": study_rows}
    _write("foundation", lines, data)


def identification_parts() -> None:
    """Bootstrap fits, settling runs, and the same fits done in several ways."""
    about = _about()
    lines = _head("Speed and success of identification", about)
    lines += ["", "| what | spinepipe ms | OpenSim CPodes ms | goal |", "|---|---|---|---|"]
    speeds, fits = [], []
    for speed in identification.speeds():
        speeds.append(asdict(speed))
        peer = "" if speed.peer_s is None else f"{1e3 * speed.peer_s:.1f}"
        lines.append(f"| {speed.what} | {1e3 * speed.ours_s:.1f} | {peer} | {speed.goal} |")
        print(lines[-1], flush=True)
    lines += [
        "",
        "Fits of three stiffnesses. Near start: within 1 %. Cost: relative to the exact fit's.",
        "Derivative error: of the cost at the start, relative; the exact one is the reference.",
        "",
        "| joint poses | method | says success | near start | cost | derivative error | runs "
        "| CPU s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in identification.fits():
        fits.append(asdict(row))
        error = "" if row.derivative_error is None else f"{row.derivative_error:.1e}"
        lines.append(
            f"| {row.pose} | {row.method} | {'yes' if row.claims_success else 'no'} "
            f"| {row.near_start} | {row.cost_ratio:.3f} | {error} | {row.runs} | {row.cpu_s:.2f} |"
        )
        print(lines[-1], flush=True)
    _write("identification", lines, {"machine": about, "speeds": speeds, "fits": fits})


def whole_study() -> None:
    """The whole study as a user runs it."""
    about = _about()
    lines = _head("The whole study", about)
    rows = _study_rows(lines, study.whole_runs())
    _write("whole_study", lines, {"machine": about, "study": rows})


def commands_part(old: str) -> None:
    """The commands of a newcomer at HEAD and at an older commit, in turn."""
    lines = [*_head("Commands", _about()), "", f"Wall seconds at HEAD beside {old}, medians.", ""]
    lines += ["| command | HEAD s | MiB | older s | MiB | ratio |", "|---|---|---|---|---|---|"]
    found = commands.measure(old)
    for step, sides in found.items():
        cells = []
        for runs in reversed(sides.values()):
            wall = statistics.median(one["wall_s"] for one in runs)
            cells += [f"{wall:.1f}", f"{max(one.get('peak_mib', 0.0) for one in runs):.0f}"]
        if len(cells) == 4:
            cells.append(f"{float(cells[0]) / float(cells[2]):.2f}")
        lines.append(f"| {step} | {' | '.join(cells)} |")
    _write("commands", lines, {"machine": _about(), "older": old, "runs": found})


def equilibria_part(old: str) -> None:
    """Stacks of spines solved from neutral at HEAD and at an older commit, in turn."""
    lines = [
        *_head("Equilibria in stacks", _about()),
        "",
        f"us each, HEAD beside {old}, least.",
        "",
    ]
    lines += ["| what | HEAD us | older us | ratio |", "|---|---|---|---|"]
    found = equilibria.beside(old)
    lines += [_beside_line(*row) for row in found]
    print(*lines, sep="\n", flush=True)
    _write("equilibria", lines, {"machine": _about(), "older": old, "figures": found})


def trunk_beside_part(old: str) -> None:
    """Samples of a person in twelve tasks and a recorded lift at HEAD and at an older commit."""
    lines = [*_head("Trunk loads, paired", _about()), "", f"CPU s, HEAD beside {old}, least.", ""]
    lines += ["Goals: 360 s for the samples, 15 s for the lift.", ""]
    lines += ["| what | HEAD s | older s | ratio |", "|---|---|---|---|"]
    found = trunk_beside.beside(old)
    lines += [_beside_line(*row) for row in found]
    print(*lines, sep="\n", flush=True)
    _write("trunk_beside", lines, {"machine": _about(), "older": old, "figures": found})


def _beside_line(what: str, new: float, was: float | None) -> str:
    older = "| |" if was is None else f"{was:.1f} | {was / new:.2f} |"
    return f"| {what} | {new:.1f} | {older}"


def cohort_parts() -> None:
    """One specimen beside OpenSim, six pooled, and the whole cohort study."""
    about = _about()
    lines = _head("Cohort study", about)
    one, pooled_s = cohort.specimen(), cohort.pooled_s()
    lines += [
        "",
        "| what | spinepipe ms | peer | peer ms | ratio | agreement |",
        "|---|---|---|---|---|---|",
        f"| {one.what} | {1e3 * one.ours_s:.0f} | {one.peer} | {1e3 * one.peer_s:.0f} "
        f"| {one.ratio:.0f} | {one.agreement} |",
        f"| six specimens pooled, three load cases, two cycles of ten steps | {1e3 * pooled_s:.0f} "
        "| none | | | |",
    ]
    print(*lines[-4:], sep="\n", flush=True)
    rows = _study_rows(lines, cohort.runs(), cohort.STUDY)
    data = {"machine": about, "specimen": {**asdict(one), "ratio": one.ratio}, "pooled_s": pooled_s}
    _write("cohort", lines, {**data, "study": rows})


def discrepancy_parts(old: str, slopes: str | None) -> None:
    """Searches for missing effects at HEAD and at an older commit, in turn."""
    about = _about()
    lines = _head("Search for missing effects", about)
    lines += ["", f"Verdicts from nothing, on two cores, HEAD beside {old}.", ""]
    lines += ["| cohort | wall s | goal | CPU s | older CPU s | ratio | verdict |"]
    lines += ["|---|---|---|---|---|---|---|"]
    rows = _told(
        lines,
        discrepancy.beside(old, Path(slopes) if slopes else None),
        lambda one: (
            f"| {one.about} | {one.new_s:.1f} | {one.goal} | {one.new_cpu_s:.1f} "
            f"| {one.old_cpu_s:.1f} | {one.new_cpu_s / one.old_cpu_s:.2f} | {one.said} |"
        ),
    )
    runs = _study_rows(lines, discrepancy.again(), "small")
    _write("discrepancy", lines, {"machine": about, "older": old, "works": rows, "again": runs})


def films_part() -> None:
    """Patients with bending films: every model by itself, and the whole study."""
    about = _about()
    lines = _head("Spines from bending films", about)
    seconds = films.patients()
    lines += [
        "",
        "Personalised and held in four positions, mean of all patients; tangent_fitted under "
        "the assumed population, which a study learns first. Goal: 1 s in all models together.",
        "",
        "| model | CPU s per patient |",
        "|---|---|",
        *(f"| {model} | {one:.2f} |" for model, one in seconds.items()),
        f"| together | {sum(seconds.values()):.2f} |",
    ]
    print(*lines[-len(seconds) - 3 :], sep="\n", flush=True)
    rows = _study_rows(lines, films.runs(), films.STUDY)
    _write("films", lines, {"machine": about, "cpu_s_per_patient": seconds, "study": rows})


def many_spines_part() -> None:
    """One equilibrium by number of joints: among many, by the engine of record, by OpenSim."""
    about = _about()
    lines = _head("Equilibria by number of joints", about)
    lines += [
        "",
        "| joints | among many, us | engine of record with loading, us | OpenSim static, us "
        "| OpenSim CPodes, ms | OpenSim default integrator, s (extrapolated) | agreement "
        "| handed on |",
        "|---|---|---|---|---|---|---|---|",
    ]
    rows = []
    for row in many_spines.growth():
        rows.append(asdict(row))
        lines.append(
            f"| {row.joints} | {1e6 * row.together_s:.0f} | {1e6 * row.engine_s:.0f} "
            f"| {1e6 * row.static_s:.0f} | {1e3 * row.cpodes_s:.0f} | {row.default_s:.0f} "
            f"| {row.difference:.0e} | {100 * row.by_engine:.0f} % |"
        )
        print(lines[-1], flush=True)
    laws = many_spines.remembering()
    lines += [
        "",
        f"With hysteresis and stiffening laws at all 6 joints, a test of {laws.steps} steps: "
        f"{1e6 * laws.together_s:.0f} us an equilibrium among many, {1e6 * laws.engine_s:.0f} us "
        f"by the engine of record; they differ by {laws.difference:.0e}, "
        f"{100 * laws.by_engine:.0f} % handed on.",
    ]
    print(lines[-1], flush=True)
    _write("many_spines", lines, {"machine": about, "growth": rows, "remembering": asdict(laws)})


def memory_part() -> None:
    """Largest memory of one process of each."""
    about = _about()
    lines = _head("Memory", about)
    lines += ["", "| a process, and all it did | MiB |", "|---|---|"]
    rows = _told(lines, processes(), lambda one: f"| {one.what} | {one.peak_mib:.0f} |")
    _write("memory", lines, {"machine": about, "processes": rows})


def machine_texts_part() -> None:
    """Texts of a testing machine, from the start of the process to a recording."""
    about = _about()
    lines = _head("Reading a testing machine's text", about)
    lines += [
        "",
        "The whole process, imports too. Goals: 10 s and 1 GB for 100 MB of plain numbers.",
        "",
        "| text | MB | rows | CPU s | wall s | MiB |",
        "|---|---|---|---|---|---|",
    ]
    rows = _told(
        lines,
        machine_texts.readings(),
        lambda row: (
            f"| {row.what} | {row.megabytes:.0f} | {row.rows:,} | {row.cpu_s:.1f} "
            f"| {row.wall_s:.1f} | {row.peak_mib:.0f} |"
        ),
    )
    _write("machine_texts", lines, {"machine": about, "readings": rows})


def sensitivity_parts() -> None:
    """Sobol studies of full size, and growth with the number of targets."""
    about = _about()
    lines = _head("Global sensitivity", about)
    found: dict[str, list[dict[str, Any]]] = {"sobol": [], "targets": []}
    for name, measured in (
        ("sobol", sensitivity.sobol_runs()),
        ("targets", sensitivity.target_runs()),
    ):
        lines += _study_head(sensitivity.STUDY)
        for one in measured:
            found[name].append(asdict(one))
            _study_lines(lines, one.runs)
    lines += [
        "",
        "| joints | solved by the engine of record | bytes per row: drawing the design "
        "| joining responses |",
        "|---|---|---|---|",
    ]
    for row in found["sobol"]:
        shares = ", ".join(f"{test} {share:.1%}" for test, share in row["handed_on"].items())
        sizes = f"{row['design_bytes']:.0f} | {row['join_bytes']:.0f}"
        lines.append(f"| {row['joints']} | {shares} | {sizes} |")
        print(lines[-1], flush=True)
    _write("sensitivity", lines, {"machine": about, **found})


def real_geometry_part(given: str | None) -> None:
    """Range of motion of the spines of a cohort that is not part of the project."""
    if given is None or not Path(given, "cohort.yaml").is_file():
        where = f"no cohort at {given}" if given else "no cohort given"
        variable = real_geometry.COHORT_VARIABLE
        print(f"real_geometry is left out: {where}; pass --cohort PATH or set {variable}")
        return
    about = _about()
    lines = _head("Range of motion of real spines", about)
    grid, runs = real_geometry.measure(Path(given))
    lines += [
        "",
        f"{grid.specimens} spines of {grid.joints} joints x {real_geometry.POSES} poses x "
        f"{real_geometry.SETS} stiffness sets: {grid.targets:,} job files of "
        f"{len(real_geometry.TESTS)} tests, {grid.rows:,} rows, {grid.without_equilibrium:,} of "
        "them without an equilibrium.",
        f"Cold run: {grid.targets / runs[0].wall_s:.0f} job files/s.",
    ]
    rows = _study_rows(lines, runs, "real_geometry")
    _write("real_geometry", lines, {"machine": about, "grid": asdict(grid), "study": rows})


def _study_rows(
    lines: list[str], runs: Iterable[study.Run], name: str = study.STUDY
) -> list[dict[str, Any]]:
    """Append the table of workflow runs to the lines; the same as data."""
    lines += _study_head(name)
    return _study_lines(lines, runs)


def _study_head(name: str) -> list[str]:
    return [
        "",
        f"| study {name}, 2 cores | wall s | memory MiB | Snakemake's own CPU s | goal |",
        "|---|---|---|---|---|",
    ]


def _study_lines(lines: list[str], runs: Iterable[study.Run]) -> list[dict[str, Any]]:
    rows = []
    for run in runs:
        rows.append(asdict(run))
        lines.append(
            f"| {run.what} | {run.wall_s:.1f} | {run.peak_mib:.0f} | {run.engine_s:.1f} "
            f"| {run.goal} |"
        )
        print(lines[-1], flush=True)
    return rows


def trunk_part() -> None:
    """Tasks of a person, samples of them, and one posture beside OpenSim's static optimisation."""
    about = _about()
    lines = _head("Trunk loads", about)
    lines += ["", "| task | ended | rounds | ms (goal 60) |", "|---|---|---|---|"]
    rows = []
    for row in trunk.tasks():
        rows.append(asdict(row))
        lines.append(f"| {row.name} | {row.status} | {row.rounds} | {1e3 * row.seconds:.0f} |")
        print(lines[-1], flush=True)
    twelve_s, standing_s = sum(row["seconds"] for row in rows), trunk.standing_s()
    sampled, peak_mib, beside = trunk.samples(), trunk.memory_mib(), trunk.beside_opensim()
    lines += [
        "",
        f"Twelve tasks: {twelve_s:.2f} s. A person of another size, upright: "
        f"{1e3 * standing_s:.0f} ms (goal 60).",
        f"{trunk.SAMPLES:,} samples x twelve tasks: {sampled.whole_s:.0f} s, extrapolated from "
        f"{sampled.samples} samples in {sampled.seconds:.0f} s; in {sampled.out_of_reach} of their "
        f"{sampled.runs + sampled.out_of_reach} tasks the hands were out of reach.",
        f"Largest memory of a process that holds the twelve tasks: {peak_mib:.0f} MiB.",
        "",
        f"One posture ({trunk.POSTURE}), straight muscles, 21 moments, nine tenths of what the "
        "muscles can make; OpenSim's `StaticOptimization`, one frame more.",
        "",
        "| what | spinepipe ms | OpenSim ms | ratio |",
        "|---|---|---|---|",
        f"| the same question, once | {1e3 * beside.ours_s:.1f} | {1e3 * beside.peer_s:.0f} "
        f"| {beside.peer_s / beside.ours_s:.0f} |",
        f"| the whole task: muscles wrap, forces and spine settled | {1e3 * beside.settled_s:.1f} "
        f"| {1e3 * beside.peer_s:.0f}, once, straight | {beside.peer_s / beside.settled_s:.0f} |",
        "",
        f"Forces differ by {beside.apart_n:.1g} N at most; the largest is "
        f"{beside.largest_n:.0f} N.",
    ]
    print(*lines[-13:], sep="\n", flush=True)
    data = {
        "tasks": rows,
        "twelve_s": twelve_s,
        "standing_s": standing_s,
        "sampled": {**asdict(sampled), "whole_s": sampled.whole_s},
        "peak_mib": peak_mib,
        "beside": asdict(beside),
    }
    _write("trunk", lines, {"machine": about, **data})


def recordings_part() -> None:
    """Recordings of motion of 100 MB."""
    about = _about()
    lines = _head("Recordings of 100 MB", about)
    lines += [
        "",
        f"Goals: {recordings.GOAL_S:g} s and {recordings.GOAL_MIB:g} MiB a file. Memory is that of "
        "the whole process.",
        "",
        "| file | MB | CPU s | peak MiB |",
        "|---|---|---|---|",
    ]
    rows = _told(
        lines,
        recordings.reads(),
        lambda row: f"| {row.what} | {row.mb:.0f} | {row.seconds:.1f} | {row.peak_mib:.0f} |",
    )
    _write("recordings", lines, {"machine": about, "rows": rows})


def tracking_part() -> None:
    """Tracked motions of 17 joints, and two joints beside CasADi and IPOPT."""
    about = _about()
    lines = _head("Motions from markers", about)
    wholes, peak_mib = tracking.wholes(), tracking.memory_mib()
    lines += [
        "",
        f"17 joints, {tracking.INTERVALS} intervals, loads `{tracking.COST}`. Goals: 5 s for one "
        "trial, 20 s and 1 GB for both with all rotations' A and B fitted.",
        "",
        "| what | ended | steps | CPU s |",
        "|---|---|---|---|",
        *(f"| {row.what} | {row.status} | {row.steps} | {row.seconds:.1f} |" for row in wholes),
        "",
        f"Largest memory of a process that calibrates both: {peak_mib:.0f} MiB.",
        "",
        "Two joints, 20 intervals, the same problem by CasADi's collocation and IPOPT; here "
        "the other 15 joints are carried along, locked.",
        "",
        "| loads | spinepipe s | IPOPT s | ratio | cost | IPOPT's |",
        "|---|---|---|---|---|---|",
    ]
    beside = tracking.beside_ipopt()
    lines += [
        f"| {row.force_cost} | {row.ours_s:.3f} | {row.peer_s:.3f} | {row.ratio:.2f} "
        f"| {row.ours:.5g} | {row.peer:.5g} |"
        for row in beside
    ]
    print(*lines[8:], sep="\n", flush=True)
    data = {
        "wholes": [asdict(row) for row in wholes],
        "peak_mib": peak_mib,
        "beside": [{**asdict(row), "ratio": row.ratio} for row in beside],
    }
    _write("tracking", lines, {"machine": about, **data})


def lost_fits_parts() -> None:
    """What the published filter makes of the published way with OpenSim's own runs."""
    about = _about()
    lines = _head("Fits lost with OpenSim's own forward runs", about)
    lines += [
        "",
        "The first sampled poses of l1l4_joint_pose. Arrived: cost within 1 % of the exact fit's.",
        "",
        "| method | fits | say success | all stiffnesses within 1 % of the start | any | arrived "
        "| cost over exact, median | runs, median |",
        "|---|---|---|---|---|---|---|---|",
    ]
    rows = _told(
        lines,
        lost_fits.counts(),
        lambda row: (
            f"| {row.method} | {row.fits} | {row.claim_success} | {row.all_near} "
            f"| {row.any_near} | {row.arrived} | {row.cost_ratio_median:.2f} "
            f"| {row.runs_median:.0f} |"
        ),
    )
    _write("lost_fits", lines, {"machine": about, "counts": rows})


def _told(
    lines: list[str], found: Iterable[Any], line: Callable[[Any], str]
) -> list[dict[str, Any]]:
    """Rows of a table, each printed as soon as it is measured and put behind ``lines``."""
    rows = []
    for one in found:
        rows.append(asdict(one))
        lines.append(line(one))
        print(lines[-1], flush=True)
    return rows


def _about() -> dict[str, str]:
    return {"date": date.today().isoformat(), **machine()}


def _head(title: str, about: dict[str, str]) -> list[str]:
    lines = [f"# {title}", "", "Written by `make bench`. CPU seconds of one core, medians.", ""]
    return lines + [f"{key}: {value}  " for key, value in about.items()]


def _write(name: str, lines: list[str], data: dict[str, Any]) -> None:
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    (RESULTS / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
