"""Projects spoilt in one place each: a sample of what `make validate` tries (wrong_inputs).

Catches a spoilt project that passes, ends in a stack, or is told of at another place.
"""

import random
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from functools import cache

import pytest
from sweeps import sweep

from spinepipe import problems
from spinepipe.problems import InputError, InputProblem
from tests.cases.spoilt_cases import MOST_TOLD, Seen, Verdict, asked, look, look_at, looked, verdict
from tests.generators.spoilt.case import Case, Expected
from tests.generators.spoilt.catalogue import cases
from tests.generators.spoilt.documented import columns, keys
from tests.generators.spoilt.keys import yaml_files
from tests.generators.spoilt.projects import projects, write

SEED = 19


@cache
def every() -> list[Case]:
    """All that can be made."""
    return list(cases())


def sample() -> Iterator[Case]:
    """A case of every family in every project; a pipe could hold a test up for good."""
    groups: dict[tuple[str, str], list[Case]] = defaultdict(list)
    for case in every():
        if case.what != "a pipe":
            groups[case.family, case.project.name].append(case)
    rng = random.Random(SEED)
    yield from (rng.choice(group) for group in groups.values())


def few() -> Iterator[Case]:
    """Every family in three of the projects, others from family to family."""
    families: dict[str, list[Case]] = defaultdict(list)
    for case in sample():
        families[case.family].append(case)
    for number, some in enumerate(families.values()):
        yield from (some[at] for at in {(number + 4 * k) % len(some) for k in range(3)})


@pytest.mark.parametrize("some", [few, pytest.param(sample, marks=pytest.mark.full)])
def test_what_is_wrong_is_told_and_what_is_not_passes(
    some: Callable[[], Iterable[Case]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    @sweep("case", some, lambda case: case.name)
    def told(case: Case) -> None:
        seen = looked(case, case.write(tmp_path_factory.mktemp("spoilt") / "project"))
        assert verdict(case, seen) is Verdict.RIGHT, seen.printed

    told()


@sweep("project", projects, lambda project: project.name)
def test_what_is_spoilt_is_sound(project, tmp_path_factory: pytest.TempPathFactory) -> None:
    seen = look_at(project, write(project.files, tmp_path_factory.mktemp("sound")))
    assert (seen.code, seen.messages) == (0, []), seen.printed


def test_cases_are_many_and_the_same_each_time() -> None:
    again = [(case.name, case.expected) for case in cases()]
    assert again == [(case.name, case.expected) for case in every()]
    assert len(every()) > 1845 + 1000
    assert {case.expected for case in every()} == set(Expected)
    assert len({name for name, _ in again}) == len(again)


def test_every_documented_key_and_every_column_that_is_there_is_spoilt() -> None:
    spoilt = {(case.file, case.place) for case in every()}
    for project in (one for one in projects() if not one.spoilt_elsewhere):
        for file, form in yaml_files(project):
            there = {place for name, place in spoilt if name == file}
            assert {entry.name for entry in keys(form) if "[" not in entry.name} <= there
        for stem in project.tables:
            file = f"{project.folder}/{stem}.csv"
            known = {entry.name for entry in columns(stem, project.kind)}
            for column in known & set(project.table(stem)[0]):
                assert (file, column) in spoilt


def case_of(what: str, file: str) -> Case:
    """The first case of a mutation of a file."""
    return next(case for case in every() if case.what == what and case.file.endswith(file))


@pytest.mark.parametrize("stand_in", [Verdict.ACCEPTED, Verdict.STACK, Verdict.ELSEWHERE])
def test_a_check_that_is_wrong_would_be_seen(stand_in: Verdict) -> None:
    """The judge itself: what a check that says nothing, breaks or points elsewhere would get."""
    case = case_of("nan", "/joints.csv")
    said = {
        Verdict.ACCEPTED: Seen(0, "ok    study x: y"),
        Verdict.STACK: Seen(-1, "Traceback"),
        Verdict.ELSEWHERE: Seen(1, "      a/loads.csv, line 2: found x; allowed: y"),
    }
    assert verdict(case, said[stand_in]) is stand_in
    fine = next(case for case in every() if case.expected is Expected.FINE)
    assert verdict(fine, said[Verdict.ELSEWHERE]) is Verdict.REFUSED


@pytest.mark.parametrize(
    ("what", "file"),
    [
        ("10 000 unknown", "/small_rig.yaml"),
        ("10 000 unknown names", "/tasks.csv"),
        ("500 unknown names", "/trials.csv"),
    ],
)
def test_unknown_names_are_compared_a_few_times(what, file, tmp_path, monkeypatch) -> None:
    compared = []
    closest = problems.closest

    def counted(name, known):
        compared.append(name)
        return closest(name, known)

    monkeypatch.setattr(problems, "closest", counted)
    case = case_of(what, file)
    seen = look(case.write(tmp_path / "project"), *asked(case))
    assert seen.code == 1
    assert len(compared) <= 2 * problems.MOST_ALIKE * 10  # so many columns have names
    assert len(seen.printed) < MOST_TOLD


def test_problems_of_one_input_fit_on_a_few_pages() -> None:
    wordy = [
        InputProblem(f"f{n}", n, f"c{n}", "x" * 150, "y" * 1400, "z" * 1400) for n in range(900)
    ]
    error = InputError(wordy)
    assert len(str(error)) < problems.MOST_CHARACTERS + 5000
    assert sum(1 + problem.others for problem in error.problems) == 900
    one = InputError([InputProblem("f", 1, "c", "x", "y" * 10**6, "z")])
    assert len(str(one)) < 5000
