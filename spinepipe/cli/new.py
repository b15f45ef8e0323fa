"""`spinepipe new`: a study of what a cohort can answer, or a cohort, as files to fill in."""

import json
import re
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer
import yaml

from spinepipe import cohort as cohorts
from spinepipe.cli.find import cohort_names, study_names, unknown, vertebrae_of
from spinepipe.cli.program import WrongUsage
from spinepipe.cohort import Cohort
from spinepipe.cohort.cohort import joint_names
from spinepipe.cohort.columns import TABLES
from spinepipe.documents.names import COHORT_NAME
from spinepipe.files import appearing
from spinepipe.imports.imported import csv_text
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.report.words import count, listed
from spinepipe.studies import read as studies
from spinepipe.studies.registry import every_form, every_kind, function_at, kind_of
from spinepipe.studies.study import COHORTS, STUDIES
from spinepipe.testing_machine.channels import DIRECTIONS, LOAD_COLUMNS
from spinepipe.testing_machine.folder import template_of_joints
from spinepipe.testing_machine.suggest import direction_of

SCHEMAS = Path("config") / "schemas"
STEPS_PER_SIDE = 5

TEST = re.compile(r"(?P<test>\w+):(?P<peak>\d+(\.\d+)?)(x(?P<cycles>\d+))?")


class What(StrEnum):
    """What can be written."""

    cohort = "cohort"
    study = "study"


def command(
    context: typer.Context,
    what: Annotated[What, typer.Argument(help="what to write")],
    name: Annotated[str, typer.Argument(help="its name: a-z, 0-9 and _")],
    kind: Annotated[
        str | None, typer.Option(help="of a study; without it, what the cohort can answer is said")
    ] = None,
    cohort: Annotated[str | None, typer.Option(help="data of a study")] = None,
    design: Annotated[
        bool,
        typer.Option(
            "--design",
            help="before there are data: which effects tests could name; the cohort has loads and "
            "needs no motion",
        ),
    ] = False,
    cycles: Annotated[int, typer.Option(min=1, help="with --design: cycles of each test")] = 3,
    misfit: Annotated[
        list[float] | None,
        typer.Option(
            metavar="SIZE",
            help="with --design: misfit that an effect makes, in SD of one reading; may be "
            "repeated [default: 0.5 0.2]",
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="with --design: .csv or .parquet [NAME.csv]"),
    ] = None,
    vertebrae: Annotated[
        str | None, typer.Option(help='of a cohort, from the lowest, as in "S1 L5 L4"')
    ] = None,
    tests: Annotated[
        str | None,
        typer.Option(
            help='of a cohort: test, largest moment in N m, cycles: "flexion_extension:7.5x3"'
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="take the first that is offered")] = False,
) -> int:
    """Write a commented study or cohort to fill in."""
    root: Path = context.obj
    if not COHORT_NAME.fullmatch(name):  # studies have the same
        raise WrongUsage(f'the name "{name}"', "take a-z, 0-9 and _ alone")
    if what is What.cohort:
        return _cohort(root, name, vertebrae, tests)
    sizes = misfit or [0.5, 0.2]
    if min(sizes) <= 0.0:
        raise WrongUsage(f"--misfit {min(sizes):g}", "sizes are above 0")
    path = root / STUDIES / f"{name}.yaml"
    if not (design and path.is_file()):
        if name in study_names(root):
            raise WrongUsage(f"{STUDIES / path.name} is there", "take another name, or edit it")
        there = cohort_names(root)
        if cohort is None and (len(there) != 1 or yes):
            raise WrongUsage("which data?", f"--cohort NAME: {one_of(there)}")
        if (cohort := cohort or there[0]) not in there:
            raise unknown("cohort", cohort, there)
        read = cohorts.read(root / COHORTS / cohort, every_form())
        if kind is None:
            kind = _able_before_data()[0] if design else _chosen(read, name, yes)
        elif kind not in every_kind():
            remedy = "leave --kind out: what the cohort can answer is then said"
            raise unknown("kind", kind, list(every_kind()), remedy)
        if design:
            _place_before_data(kind)
        _write_study(root, path, kind, cohort)
        if not design:
            print(f"Wrote {STUDIES / path.name}.")
            print(f"Next: spinepipe plan {name}")
            return 0
    return _before_data(root, name, cycles, sizes, to or Path(f"{name}.csv"))


def _chosen(read: Cohort, name: str, yes: bool) -> str:
    """The kind that is asked for, of those that the cohort can answer.

    Raises
    ------
    InputError
        Where it can answer none, with why.
    """
    # what can be asked before there are data comes first, all others by name
    ordered = sorted(every_kind(), key=lambda one: (kind_of(one).before_data is None, one))
    offered, lacks, problems = list[str](), list[str](), list[InputProblem]()
    # every kind's files were read; where vertebrae are, only some of them tell
    placed = read.joints is not None or read.landmarks is not None
    for kind in ordered:
        if not placed and not any(form.places for form in kind_of(kind).forms):
            lacks.append(f"  {kind}: needs landmarks.csv or joints.csv")
            continue
        data = {"study": name, "kind": kind, "cohort": read.name}
        try:
            studies.of_data(data | (yaml.safe_load(kind_of(kind).starter) or {}), read, name)
            offered.append(kind)
        except InputError as error:
            lacks.append(f"  {kind}: needs {error.problems[0].allowed}")
            problems += error.problems
    print(
        f"{read.name}: {count(len(read.specimen_names), 'specimen')}, "
        f"{count(len(read.tests), 'test')}. It can answer:"
    )
    for number, kind in enumerate(offered, start=1):
        known = kind_of(kind)
        print(f"  {number}  {kind:24}{known.question:32}{known.cost}".rstrip())
    print("\n".join(["It cannot answer:", *lacks]) if lacks else "")
    if not offered:
        raise InputError(problems)
    number = 1
    while not yes and not 1 <= (number := typer.prompt("Which?", default=1)) <= len(offered):
        print(f"A number from 1 to {len(offered)}.")
    return offered[number - 1]


def _write_study(root: Path, path: Path, kind: str, cohort: str) -> None:
    """Write the study file, and the schema by which editors complete and check its keys."""
    known, schema = kind_of(kind), root / SCHEMAS / f"{kind}.schema.json"
    text = json.dumps(known.settings.model_json_schema(), indent=1, ensure_ascii=False) + "\n"
    lines = [
        f"# yaml-language-server: $schema=../{SCHEMAS.name}/{schema.name}",
        f"# {known.question} All keys: docs/studies/{kind}.md",
        f"study: {path.stem}",
        f"kind: {kind}",
        f"cohort: {cohort}",
    ]
    for file, content in ((schema, text), (path, "\n".join(lines) + "\n" + known.starter)):
        with appearing(file) as temporary:
            temporary.write_text(content, encoding="utf-8")


def _able_before_data() -> list[str]:
    """Kinds that say something before there are data."""
    return [name for name, known in every_kind().items() if known.before_data]


def _place_before_data(kind: str) -> str:
    """Where a kind has what it says before there are data.

    Raises
    ------
    WrongUsage
        Where it says nothing then.
    """
    if (place := kind_of(kind).before_data) is None:
        able = listed(_able_before_data())
        raise WrongUsage(f"--design of a study of kind {kind}", f"--kind {able}")
    return place


def _before_data(root: Path, name: str, cycles: int, sizes: Sequence[float], to: Path) -> int:
    """Say which effects planned tests could name, and write all of it as a table."""
    study = studies.read(root / STUDIES / f"{name}.yaml", root)
    place = _place_before_data(study.kind)
    cohort = cohorts.read(study.cohort_folder(root))
    said = function_at(study.kind, place)
    for line in said(study, cohort, root, cycles, sizes, to):
        print(line)
    print(f"Next: change loads.csv in {COHORTS / cohort.name} and ask again, or measure; then")
    print(f"  spinepipe import FILES... --cohort {cohort.name} --replace")
    return 0


def _cohort(root: Path, name: str, vertebrae: str | None, tests: str | None) -> int:
    """Write a cohort folder of one specimen with planned loads and no motion."""
    folder = root / COHORTS / name
    if folder.exists():
        raise WrongUsage(f"{COHORTS / name} is there", "take another name")
    chain = vertebrae_of(vertebrae or typer.prompt("Vertebrae, from the lowest", "L5 L4"))
    asked = tests or typer.prompt("Tests", default="flexion_extension:7.5x3")
    found = [TEST.fullmatch(one) for one in asked.split()]
    if not all(found) or not all(direction_of(one["test"]) for one in found if one):
        remedy = 'as in "flexion_extension:7.5x3 lateral_bending:7.5x3 axial_rotation:7.5x3"'
        raise WrongUsage(f'--tests "{asked}"', remedy)
    told = [(one["test"], float(one["peak"]), int(one["cycles"] or 3)) for one in found if one]
    joints = joint_names(chain)
    motion = [
        ("s01", test, cycle, step, joint, *[""] * 6)
        for test, peak, cycles in told
        for cycle in range(1, cycles + 1)
        for step, _ in enumerate(_moments(peak))
        for joint in joints
    ]
    loads = [
        (
            "*",
            test,
            step,
            chain[-1],
            *(way.sign * m + 0.0 if c == way.load else 0 for c in LOAD_COLUMNS),
        )
        for test, peak, _ in told
        for way in (DIRECTIONS[direction_of(test)],)
        for step, m in enumerate(_moments(peak))
    ]
    rows: dict[str, list[Sequence[object]]] = {
        "specimens.csv": [("specimen",), ("s01",)],
        "joints.csv": [TABLES["joints"].names, *template_of_joints(["s01"], joints)],
        # alike in every cycle
        "loads.csv": [("specimen", "test", "step", "vertebra", *LOAD_COLUMNS), *loads],
        "motion_to_fill.csv": [TABLES["motion"].names, *motion],
    }
    header = f"""# All keys: docs/cohort-format.md
cohort: {name}
title: {name.replace("_", " ")}, {count(len(told), "planned test")}  # one line that says what it is
source: not measured yet  # who measured what, when, how; licence
vertebrae: [{", ".join(chain)}]  # from the lowest, which is held
gravity: false  # true: weight acts, and bodies.csv tells masses
zeroed_at_step_0: true  # readings count from step 0 of their cycle
measurement_sd: {{rotation_deg: 0.1, translation_mm: 0.1}}  # repeatability of one reading
accuracy: {{rotation_deg: 0.1, translation_mm: 0.1}}  # of the instrument, as its maker states it
"""
    files = {"cohort.yaml": header} | {file: csv_text(made) for file, made in rows.items()}
    for file, content in files.items():
        with appearing(folder / file) as temporary:
            temporary.write_text(content, encoding="utf-8")
    try:
        cohorts.read(folder, every_form())
    except InputError:
        for file in files:
            (folder / file).unlink()
        folder.rmdir()
        raise
    print(f"Wrote {COHORTS / name}: {listed(files, len(files))}.")
    print("Put in the specimens, and in joints.csv where the joints are. Before there are data:")
    print(f"Next: spinepipe new study {name}_design --design --cohort {name}")
    print("With readings in it, rename motion_to_fill.csv to motion.csv.")
    return 0


def _moments(peak: float) -> list[float]:
    """Up, across to the other side and back, as an import thins a cycle, N m."""
    ends = [0.0, peak, -peak, 0.0]
    steps = [STEPS_PER_SIDE, 2 * STEPS_PER_SIDE, STEPS_PER_SIDE]
    parts = zip(pairwise(ends), steps, strict=True)
    return [0.0, *(a + (b - a) * k / n for (a, b), n in parts for k in range(1, n + 1))]
