"""Rules that forms declare: each is kept by sound rows and broken where it says, told in its words.

Catches a rule that lets a bad row pass, blames a sound one, or is told at another place.
"""

from pathlib import Path
from typing import get_args

import pandas as pd
import pytest

from spinepipe.cohort.columns import TABLES
from spinepipe.cohort.supports import FREE, HELD, MEASURED, PRESCRIBED
from spinepipe.documents.form import InputColumn, Rule, TableForm, read_forms
from spinepipe.documents.rules import Listed, TableCheck
from spinepipe.motion.body_segments import ARMS
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.skeleton import BODIES
from spinepipe.muscles import regressions
from spinepipe.problems import InputProblem
from spinepipe.studies.recordings import STANCE, TRIALS
from spinepipe.studies.scoliosis.films import CENTRE, CORNERS, FILMS, NEEDED
from spinepipe.studies.tracking.trials import FORMS, MOVING
from spinepipe.studies.trunk_loads.checks import CARRIERS
from spinepipe.studies.trunk_loads.forms import BODY_FRAMES, FORCE, HANDS, TASKS, UPRIGHT
from spinepipe.units import COORDINATES

Place = tuple[int, str]

COLUMNS = (
    InputColumn("name", "text", "name", key=True, nullable=False, names="name"),
    InputColumn("repeat", "integer", "repeat", key=True, nullable=True, empty_is=1.0),
    InputColumn("low", "number", "lowest", nullable=True),
    InputColumn("high", "number", "highest", nullable=True),
    InputColumn("way", "text", "way", nullable=True, allowed=("up", "down")),
    InputColumn("joint", "text", "joint", nullable=True, references="joints", wildcard=True),
    InputColumn("trial", "text", "trial", nullable=True, references="trials.trial", per="name"),
)


def told(
    *rows: dict[str, object], rule: Rule | None = None, bad: Place = (2, "high"), **other: object
) -> list[InputProblem]:
    """What is said of rows; each is sound but for what it gives."""
    whole = [{"name": f"n{k}", "way": "up"} | row for k, row in enumerate(rows)]
    table = pd.DataFrame(whole, columns=[c.name for c in COLUMNS], index=range(2, 2 + len(rows)))
    table = table.astype({c.name: float for c in COLUMNS if c.type != "text"})
    form = TableForm("t", "row", COLUMNS, () if rule is None else (rule,), titled="{name}: ")
    trials = pd.DataFrame({"name": ["n0", "n0", "n1"], "trial": ["a", "b", "c"]})
    lists = {
        "joints": Listed(["L4L5", "L3L4"], "cohort.yaml", {"L5L4": "turn it round"}),
        "trials.trial": Listed(["a", "b", "c"], "trials.csv"),
        "names": Listed(["n0", "n9"], "names.csv"),
        **other,
    }
    check = TableCheck(form, "t.csv", table, {bad}, lists.get, {"trials": trials})
    return list(check.problems())


def places(problems: list[InputProblem]) -> list[tuple[int | None, str | None, str]]:
    return [(one.row, one.column, one.found) for one in problems]


def test_sound_rows_keep_all_rules() -> None:
    assert told({"joint": "*", "trial": "b"}, {"joint": "L4L5", "trial": "c", "repeat": 2.0}) == []


@pytest.mark.parametrize(
    ("row", "column", "found", "remedy"),
    [
        ({"way": "dwon"}, "way", "n0: 'dwon'", "did you mean 'down'?"),
        ({"way": "UP"}, "way", "n0: 'UP'", "did you mean 'up'?"),
        ({"joint": "L5L4"}, "joint", "unknown joint 'L5L4'", "turn it round"),
        ({"joint": "hip"}, "joint", "unknown joint 'hip'", "or add it to cohort.yaml"),
        ({"trial": "c"}, "trial", "no trial 'c' of 'n0'", ""),
        ({"name": "a/b"}, "name", "'a/b' with '/' (solidus)", "rename it in every file"),
    ],
)
def test_a_cell_is_told(row: dict[str, object], column: str, found: str, remedy: str) -> None:
    (problem,) = told(row)
    assert places([problem]) == [(2, column, found)]
    assert remedy in problem.remedy


def test_nothing_is_told_of_names_that_nothing_lists() -> None:
    assert told({"joint": "hip"}, joints=None) == []
    (problem,) = told({"joint": "hip"}, joints=Listed([], "loads.csv"))
    assert problem.allowed == "one of *"


def test_an_empty_key_counts_as_what_it_stands_for() -> None:
    (problem,) = told({"name": "a"}, {"name": "a", "repeat": 1.0}, {"name": "a", "repeat": 2.0})
    assert (problem.row, problem.found) == (3, "again a, 1")
    assert problem.allowed == "one row per name x repeat"
    assert problem.remedy == "delete one (the other is line 2)"


TOGETHER = Rule(together=("low", "high"), found="no {lacking}")
EITHER = Rule(any_of=("low+high", "joint"), found="neither of {name}", at="joint")
ASCENDING = Rule(ascending=("low", "high"), at="low", found="{low:g} to {high:g}")


@pytest.mark.parametrize(
    ("rule", "row", "found"),
    [
        (TOGETHER, {"low": 1.0, "high": 2.0}, []),
        (TOGETHER, {}, []),
        (TOGETHER, {"low": 1.0}, [(3, "high", "n1: no high")]),
        (EITHER, {"low": 1.0, "high": 2.0}, []),
        (EITHER, {"joint": "*"}, []),
        (EITHER, {"low": 1.0}, [(3, "joint", "n1: neither of n1")]),
        (ASCENDING, {"low": 1.0, "high": 2.0}, []),
        (ASCENDING, {"low": 1.0}, []),
        (ASCENDING, {"low": 2.0, "high": 2.0}, [(3, "low", "n1: 2 to 2")]),
    ],
)
def test_a_rule_of_a_row(rule: Rule, row: dict[str, object], found: list[object]) -> None:
    """The first row has a cell that the reader refused: nothing more is said of it."""
    refused = {"low": 1.0, "joint": "*"}
    assert places(told(refused, row, rule=rule)) == found


def test_rules_wait_for_a_sound_header() -> None:
    """A column that lacks may be there under another name."""
    assert told({}, {"low": 1.0}, rule=TOGETHER, bad=(1, "hihg")) == []


def test_many_names_are_not_listed() -> None:
    many = Listed([f"L{k}" for k in range(61)], "joints.csv")
    (problem,) = told({"joint": "hip"}, joints=many)
    assert problem.allowed == "a joint of joints.csv"


def test_groups_have_enough_rows() -> None:
    rule = Rule(at_least=2, per="name", where={"way": ["up"]}, at="way", found="{count} of {name}")
    rows = [{"name": "a", "repeat": k, "way": way} for k, way in enumerate(("up", "down"), 1)]
    assert places(told(*rows, rule=rule)) == [(2, "way", "1 of a")]
    maybe = told(rows[0], rows[1] | {"way": "pu"}, rule=rule)
    assert places(maybe) == [(3, "way", "a: 'pu'")]


def test_everybody_has_a_row() -> None:
    rule = Rule(at_least=1, per="name", among="names", found="no row of '{name}'")
    assert places(told({}, rule=rule)) == [(None, "name", "no row of 'n9'")]
    assert told({}, {}, rule=rule) == []  # n1 is unknown: it may be n9 misspelt
    assert told({}, rule=rule, names=None) == []


def test_rows_beyond_the_most_are_told_each() -> None:
    rule = Rule(at_most=1, per="name", where={"way": ["up"]}, at="way", found="again {name}")
    rows = [{"name": "a", "repeat": float(k)} for k in (1, 2, 3)]
    assert places(told(*rows, rule=rule)) == [(3, "way", "again a"), (4, "way", "again a")]


def test_forms_allow_the_words_that_the_library_knows() -> None:
    (table,) = read_forms(Path(regressions.__file__).with_name("forms.yaml")).values()
    assert table.column("level").allowed == ("*", *regressions.REGRESSION_LEVELS)
    assert table.column("quantity").allowed == regressions.QUANTITIES
    assert table.column("form").allowed == get_args(regressions.Form)
    supports = TABLES["supports"]
    assert supports.column("coordinate").allowed == COORDINATES
    assert supports.column("state").allowed == (FREE, HELD, PRESCRIBED)
    assert MEASURED in supports.column("reaction").allowed
    assert TASKS.column("counted_from").allowed[0] == UPRIGHT
    assert FORCE in TASKS.column("applied_as").allowed
    assert set(HANDS) < set(TASKS.names)
    assert BODY_FRAMES.column("carried_by").allowed == CARRIERS
    assert TRIALS.column("kind").allowed == (STANCE, *MOVING)
    assert TRIALS.column("arms").allowed == ARMS
    passive = next(form for form in FORMS if form.stem == "passive")
    assert passive.column("side").allowed == SIDES
    markers = next(form for form in FORMS if form.stem == "marker_set")
    assert markers.rules[0].where == {"vertebra": [BODIES[0]]}
    assert [rule.together for rule in FILMS.rules[-2:]] == [CENTRE, CORNERS]
    assert [rule.where for rule in FILMS.rules[:-2]] == [{"position": [one]} for one in NEEDED]
