"""`spinepipe check`: every problem of studies and cohorts, and every doubt, before anything runs.

A problem stops a run, a doubt (`warn`) does not: units and signs that no cell gives away. What
cannot be right, as a spine ten times too large, is a problem unless cohort.yaml says it is meant.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from spinepipe.cli.find import cohort_names, study_names, unknown
from spinepipe.cohort import Cohort, Reader
from spinepipe.marks import mark_in
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.words import count
from spinepipe.studies import read as studies
from spinepipe.studies.free import unmeasured
from spinepipe.studies.plausibility import doubts, refusals
from spinepipe.studies.read import ReadCohort
from spinepipe.studies.registry import every_form, files_of, function_at, kind_of
from spinepipe.studies.study import COHORTS, Study


def command(
    context: typer.Context,
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAMES]...", help="studies or cohorts", show_default="all"),
    ] = None,
    results: Annotated[
        bool,
        typer.Option("--results", help="look at result files; those not as written are removed"),
    ] = False,
) -> int:
    """Say what is wrong with cohorts and studies."""
    root, names = context.obj, names or []
    if results:
        return _run_results(root, names)
    told: set[InputProblem] = set()
    warned: dict[str, tuple[InputProblem, ...]] = {}
    if not names:
        warned["config/studies"] = tuple(studies.strays(root))
        for warning in warned["config/studies"]:
            print(f"warn  {warning}")
    seen = [_tell(title, look, told, warned) for title, look in _tasks(root, names)]
    problems = [asdict(one) for one in told]
    warnings = [asdict(one) for group in warned.values() for one in group]
    context.meta["data"] = {"checked": seen, "problems": problems, "warnings": warnings}
    if told:
        print(f"\n{count(len(told), 'problem')} in all; nothing was changed.")
    if warnings:
        number = len(warnings)
        print(f"\n{count(number, 'warning')} in all, which stop no run: look at the files first.")
    if not told and len(names) == 1:
        verb = "plan" if names[0] in study_names(root) else "show"
        print(f"Next: spinepipe {verb} {names[0]}")
    return 0 if all(one["ok"] for one in seen) else 1


def _run_results(root: Path, names: list[str]) -> int:
    """Remove result files of studies that are not as they were written, and say which.

    A run asks the files that it needs; this asks all that a study declares, also job files whose
    rows are in a table already. Files of somebody else's and links are left alone.
    """
    known = study_names(root)
    if strange := [name for name in names if name not in known]:
        raise unknown("study", strange[0], known)
    computed = [name for name in names or known if (root / "results" / name).is_dir()]
    damaged, sound = [], 0
    for name in computed:
        for path in files_of(*studies.check(root, name, starting=False)).every():
            mark = None if (root / path).is_symlink() else mark_in(root / path)
            sound += bool(mark)
            damaged += [path] if mark == "" else []
    for path in damaged:
        (root / path).unlink()
        print(f"FAIL  {path}: damaged, cut off, empty or of an older version; removed")
    print(f"{count(sound, 'result file')} as written, {len(damaged)} removed.")
    if damaged:
        print("`snakemake all` computes them again.")
    return 1 if damaged else 0


@dataclass(frozen=True)
class CheckedInput:
    """What is sound: in words, its own warnings, and the cohort whose data may be doubted."""

    words: str
    warnings: tuple[InputProblem, ...] = ()
    cohort: Cohort | None = None


Look = Callable[[], CheckedInput]
"""Looks at one thing, or raises."""

Task = tuple[str, Look]


def _tasks(root: Path, names: list[str]) -> list[Task]:
    """What is looked at: its title, and what looks at it."""
    known_studies, known_cohorts = study_names(root), cohort_names(root)
    read = Reader().read
    if not known_studies and not known_cohorts:
        allowed = "a folder with config/studies and config/cohorts"
        remedy = "go there or pass --root"
        raise InputError(
            [InputProblem(str(root), None, None, "no studies, no cohorts", allowed, remedy)]
        )
    if not names:

        def chosen() -> CheckedInput:
            selection = studies.read_selection(root)
            return CheckedInput(f"a plain run builds {', '.join(selection.studies)}")

        tasks: list[Task] = [("config/config.yaml", chosen)]
        tasks += [_study_task(root, name, read) for name in known_studies]
        return tasks + [_cohort_task(root, name, read) for name in known_cohorts]
    tasks = []
    for name in names:
        if name in known_studies:
            tasks.append(_study_task(root, name, read))
        elif name in known_cohorts:
            tasks.append(_cohort_task(root, name, read))
        else:
            raise unknown("study or cohort", name, [*known_studies, *known_cohorts])
    return tasks


def _study_task(root: Path, name: str, read: ReadCohort) -> Task:
    def look() -> CheckedInput:
        study, cohort = _checked(root, name, read)
        words, warnings = _told_by_kind(study, cohort, root)
        told = f"{study.kind} on cohort {cohort.name}"
        warnings = warnings or unmeasured(root, study, cohort)
        return CheckedInput("; ".join(filter(None, (told, words))), warnings, cohort)

    return f"study {name}", look


def _checked(root: Path, name: str, read: ReadCohort) -> tuple[Study, Cohort]:
    """A sound study and its cohort.

    What cannot be right in a cohort is told first where the two do not fit: lengths in cm, or loads
    that are all zero, are behind many misfits.
    """
    try:
        return studies.check(root, name, read_cohort=read)
    except studies.Misfit as error:
        raise InputError([*refusals(error.cohort), *error.problems]) from error


def _cohort_task(root: Path, name: str, read: ReadCohort) -> Task:
    def look() -> CheckedInput:
        cohort = read(root / COHORTS / name, every_form())
        return CheckedInput(_described(cohort), cohort=cohort)

    return f"cohort {name}", look


def _told_by_kind(study: Study, cohort: Cohort, root: Path) -> tuple[str, tuple[InputProblem, ...]]:
    """What the kind of a sound study says of it, and warns of."""
    place = kind_of(study.kind).told_by_check
    if place is None:
        return "", ()
    told: tuple[str, tuple[InputProblem, ...]] = function_at(study.kind, place)(study, cohort, root)
    return told


def _described(cohort: Cohort) -> str:
    readings = 0 if cohort.motion is None else len(cohort.motion)
    parts = (
        count(len(cohort.specimen_names), "specimen"),
        count(len(cohort.joint_names), "joint"),
        count(len(cohort.tests), "test"),
        count(readings, "row of motion", "rows of motion"),
    )
    further = (
        count(len(rows), f"row of {name}", f"rows of {name}")
        for name, rows in cohort.further.items()
    )
    return ", ".join((*parts, *further))


def _tell(
    title: str, look: Look, told: set[InputProblem], warned: dict[str, tuple[InputProblem, ...]]
) -> dict[str, Any]:
    """Print how one thing is; what was told before is not told again.

    Parameters
    ----------
    warned : what was warned of, by the title of the study or the folder of the cohort.
    """
    try:
        seen = look()
        if seen.cohort is not None and (refused := refusals(seen.cohort)):
            raise InputError(refused)
    except InputError as error:
        new = [problem for problem in error.problems if problem not in told]
        known = len(error.problems) - len(new)
        above = f" ({count(known, 'problem')} of these told above)" if known else ""
        print(f"FAIL  {title}{above}")
        for problem in new:
            print(f"      {problem}")
        told.update(new)
        return {"name": title, "ok": False, "found": ""}
    print(f"ok    {title}: {seen.words}")
    new_warnings = {title: seen.warnings}
    folder = None if seen.cohort is None else str(seen.cohort.folder.resolve())
    if seen.cohort is not None and folder is not None and folder not in warned:
        new_warnings[folder] = doubts(seen.cohort)
    for warning in (one for group in new_warnings.values() for one in group):
        print(f"warn  {warning}")
    warned |= new_warnings
    return {"name": title, "ok": True, "found": seen.words}
