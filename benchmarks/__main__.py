"""`python -m benchmarks`: measure, print, and write benchmarks/results/foundation.{md,json}."""

import json
from dataclasses import asdict
from datetime import date
from pathlib import Path

from benchmarks import engine, study
from benchmarks.timing import machine

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Run everything and write one table of each kind."""
    about = {"date": date.today().isoformat(), **machine()}
    lines = ["# Speed", "", "Written by `make bench`. CPU seconds of one core, medians.", ""]
    lines += [f"{key}: {value}  " for key, value in about.items()]
    lines += [
        "",
        "| what | spinepipe ms | peer | peer ms | ratio | agreement |",
        "|---|---|---|---|---|---|",
    ]
    engine_rows = []
    for rows in (engine.equilibria(), engine.calibrations()):
        for row in rows:
            engine_rows.append({**asdict(row), "ratio": row.ratio})
            peer = f"{row.peer} ({row.note})" if row.note else row.peer
            lines.append(
                f"| {row.what} | {1e3 * row.ours_s:.2f} | {peer} | {1e3 * row.peer_s:.4g} "
                f"| {row.ratio:.0f} | {row.agreement} |"
            )
            print(lines[-1], flush=True)
    lines += [
        "",
        "| study l1l4_joint_pose, 2 cores | wall s | memory MiB | Snakemake's own CPU s | goal |",
        "|---|---|---|---|---|",
    ]
    study_rows = []
    for run in study.runs():
        study_rows.append(asdict(run))
        lines.append(
            f"| {run.what} | {run.wall_s:.1f} | {run.peak_mib:.0f} | {run.engine_s:.1f} "
            f"| {run.goal} |"
        )
        print(lines[-1], flush=True)
    per_target = 1e3 * study_rows[0]["engine_s"] / study.targets()
    lines += ["", f"Snakemake's own CPU per target of the cold run: {per_target:.1f} ms (goal 7)."]
    print(lines[-1], flush=True)
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "foundation.md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    data = {"machine": about, "engine": engine_rows, "study": study_rows}
    (RESULTS / "foundation.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
