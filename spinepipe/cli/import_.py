"""`spinepipe import`: files of a testing machine become a cohort folder."""

import argparse
from pathlib import Path

from spinepipe.report.words import count, listed
from spinepipe.studies.study import COHORTS
from spinepipe.testing_machine import folder as folders
from spinepipe.testing_machine.folder import ImportedCohort
from spinepipe.testing_machine.load_steps import ResampledTest
from spinepipe.testing_machine.recording import Recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which YAML, and whether a folder may be written again."""
    parser.add_argument(
        "mapping", type=Path, metavar="FILE.yaml", help="says what the columns of the files are"
    )
    parser.add_argument(
        "--replace",
        action="store_true",
        help="write a cohort again that is there; joints.csv and specimens.csv stay",
    )


def run(options: argparse.Namespace) -> int:
    """Read all files, write the folder, and say what was done."""
    imported = folders.read(options.mapping)
    name = imported.mapping.cohort
    folder = options.root / COHORTS / name
    stayed = folders.write(imported, folder, options.replace)
    for test in imported.tests:
        for line in _of_test(test):
            print(line)
    print(f"SD of a reading: {folders.sd_sentence(imported)}")
    print(_zero(imported))
    steps = sum(len(cycle.motion) for test in imported.tests for cycle in test.cycles)
    print(f"Wrote {COHORTS / name}, {count(steps, 'load step')} in all.")
    if "joints.csv" in stayed:
        print(f"{listed(stayed)} were there and stayed as they are.")
    else:
        print(
            "joints.csv is a template: it has the first joint at the origin, all axes along ground."
            " Put in where the joints are before you trust anything but rotations under moments."
        )
    print(f"Next: spinepipe check {name}, then spinepipe show {name}.")
    return 0


def _of_test(test: ResampledTest) -> list[str]:
    lines = []
    for one, found in zip(test.recordings, test.cuts, strict=True):
        kept = len(found.kept)
        rows = count(len(one.lines), "row")
        if one.spikes:
            rows += f" without {count(one.spikes, 'row')} in which a reading jumps"
        lines.append(
            f"{one.file}: {rows}; the load "
            f"runs from {found.low:.3g} to {found.high:.3g} {_unit(one)} and turns back "
            f"{count(found.reversals, 'time')}: {count(len(found.cycles), 'cycle')}, {kept} kept."
        )
        lines += [f"  Cycle {number} is left out: {why}." for number, why in found.left_out]
    unit = _unit(test.recordings[0])
    lines.append(
        f"  {test.specimen}, {test.test}: {count(len(test.cycles), 'cycle')} of "
        f"{count(len(test.levels), 'load step')} each, from {min(test.levels):.3g} to "
        f"{max(test.levels):.3g} {unit}, there and back."
    )
    return lines


def _unit(one: Recording) -> str:
    return "N" if one.driving.endswith("_n") else "N m"


def _zero(imported: ImportedCohort) -> str:
    if imported.mapping.zeroed:
        return "Readings count from those of step 0 of their cycle (zeroed_at_step_0: true)."
    return "Readings stay as they are: their zero must be the neutral pose."
