"""Digests of code: they change with what a job uses and with nothing else.

Catches results that are believed though their code changed, and results that are thrown away for a
reworded column, a new effect or a table of another job.
"""

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from spinepipe.jobs import code
from spinepipe.studies.registry import every_kind, place_of

MODULE = "spinepipe.jobs.collect"


def forget() -> None:
    """As a new process knows nothing."""
    for known in (code._known, code._file, code._used, code.closure, code.code_digest):
        known.cache_clear()
    for known in (code._layouts, code.effect_modules, code._data_digest, code._rows):
        known.cache_clear()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    path = tmp_path / "kept.json"
    monkeypatch.setattr(code, "_KEPT", path)
    forget()
    yield path
    forget()


def test_a_job_hangs_on_the_tables_that_it_writes_and_on_none_of_another_kind() -> None:
    for kind, declared in every_kind().items():
        own = f"spinepipe.studies.{kind}#"
        for job in declared.jobs:
            used = code.closure(place_of(kind, job.name).partition(":")[0])
            tables = {name for name in used if "#" in name}
            assert tables >= {f"{own}{table}" for table in job.writes}, job.name
            assert {name for name in tables if not name.startswith(own)} == set(), job.name
            assert not {f"{own}*", f"spinepipe.studies.{kind}.tables"} & used, job.name


def test_what_reads_and_checks_is_in_no_digest() -> None:
    """Its values are: a rule of input that is added computes nothing again."""
    reading = {"spinepipe.cohort.checks", "spinepipe.studies.read", "spinepipe.jobs.code"}
    for kind, declared in every_kind().items():
        for job in declared.jobs:
            used = code.closure(place_of(kind, job.name).partition(":")[0])
            assert not reading & used, job.name


def test_what_was_kept_gives_the_same_digest(kept: Path) -> None:
    fresh = code.code_digest(MODULE)
    code.keep()
    forget()
    assert code._known()
    assert code.code_digest(MODULE) == fresh


def test_a_file_that_has_changed_since_is_read_again(kept: Path) -> None:
    fresh = code.code_digest(MODULE)
    code.keep()
    data = json.loads(kept.read_text("utf-8"))
    for state in data["files"].values():
        state[0][1] += 1
        state[1][1] = "0" * 64
    kept.write_text(json.dumps(data), "utf-8")
    forget()
    assert code.code_digest(MODULE) == fresh


@pytest.mark.parametrize("content", ["", "{", '{"python": "2.7", "files": {"a": 1}}', "[1]"])
def test_what_cannot_be_read_is_not_believed(kept: Path, content: str) -> None:
    fresh = code.code_digest(MODULE)
    kept.write_text(content, "utf-8")
    forget()
    assert code.code_digest(MODULE) == fresh


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: Path) -> Path:
    """A made-up package in the place of this one: `spinepipe.own` imports `spinepipe.used.it`."""
    monkeypatch.setattr(code, "_ROOT", tmp_path)
    for known in (code._source, code._data_digest, code.effect_modules):
        monkeypatch.setattr(code, known.__name__, cache(known.__wrapped__))
    for folder in ("used", "other"):
        (tmp_path / "spinepipe" / folder).mkdir(parents=True)
        (tmp_path / "spinepipe" / folder / "it.py").write_text("x = 1\n", "utf-8")
        (tmp_path / "spinepipe" / folder / "__init__.py").write_text("", "utf-8")
    (tmp_path / "spinepipe/__init__.py").write_text("", "utf-8")
    (tmp_path / "spinepipe/own.py").write_text("from spinepipe.used import it\n", "utf-8")
    return tmp_path / "spinepipe"


def digest(path: Path | None = None, text: str = "") -> str:
    """Of `spinepipe.own`, as a new process tells it once a file has this text."""
    if path is not None:
        path.write_text(text, "utf-8")
    forget()
    return code.code_digest("spinepipe.own")


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        *((f"used/published{suffix}", True) for suffix in code._DATA_SUFFIXES),
        ("published.csv", True),
        ("other/published.csv", False),
        ("used/notes.txt", False),
    ],
)
def test_data_beside_imported_modules_counts(package: Path, name: str, counts: bool) -> None:
    """Whether it is there and what it holds: published values decide results as code does."""
    without, one = digest(), digest(package / name, "1\n")
    assert (one != without, digest(package / name, "2\n") != one) == (counts, counts)
    (package / name).rename((package / name).with_stem("renamed"))
    assert (digest() != one) is counts


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ('"""Doc."""\nx = 1  # why\n', "x = 1\n", True),
        ("def f():\n    '''Doc.'''\n    return 1\n", "def f():\n\n    return 1\n", True),
        ("x = 1\n", "x = 2\n", False),
        ("x = 'text'\n", "x = 'other'\n", False),
        ("from spinepipe import units\n", "from spinepipe import files\n", False),
    ],
)
def test_only_meaning_counts(tmp_path: Path, one: str, other: str, same: bool) -> None:
    files = [tmp_path / "one.py", tmp_path / "other.py"]
    for path, text in zip(files, (one, other), strict=True):
        path.write_text(text, "utf-8")
    first, second = (code._read("spinepipe.made_up", path) for path in files)
    assert (first == second) is same


ROWS = """table,column,type,unit,key,low,high,allowed,empty,meaning
@place,{}_mm,number,mm,,,,,was not read,where {} is
one,,table,,,,,,,About it.
one,specimen,text,,key,,,,,which it is
one,along,@place,,,,,,,
other,,table,,,,,,,About the other.
other,specimen,text,,key,,,,,which it is
"""


@pytest.mark.parametrize(
    ("was", "becomes", "counts"),
    [
        ("where {} is", "its place", False),
        ("was not read", "nobody read it", False),
        ("About it.", "All about it", False),
        ("other,specimen,text,", "other,person,integer,", False),
        ("other,specimen,text,,key", "other,specimen,text,,", False),
        ("{}_mm", "{}_m", True),
        (",mm,", ",m,", True),
        (",number,", ",integer,", True),
        ("was not read", "", True),
        ("one,specimen,text,,key", "one,specimen,text,,", True),
        ("one,along", "one,across", True),
    ],
)
def test_of_tables_the_imported_ones_count_without_words(
    package: Path, was: str, becomes: str, counts: bool
) -> None:
    (package / "schema").mkdir()
    (package / "schema/__init__.py").write_text("def declared(module, name): ...\n", "utf-8")
    (package / "used/it.py").write_text(
        "from spinepipe.schema import declared\n"
        'ONE = declared(__file__, "one")\nOTHER = declared(__file__, "other")\n',
        "utf-8",
    )
    (package / "own.py").write_text("from spinepipe.used.it import ONE\n", "utf-8")
    assert was in ROWS
    file = package / "used/tables.csv"
    assert (digest(file, ROWS) != digest(file, ROWS.replace(was, becomes))) is counts


@pytest.mark.parametrize(
    ("own", "counts"),
    [
        ("from spinepipe.effects import create\n", False),
        ("from spinepipe.effects import create\ncreate('creep')\n", True),
        ("from spinepipe.effects import registered\n", True),
    ],
)
def test_effects_count_where_they_are_named_or_all_are_asked_for(
    package: Path, own: str, counts: bool
) -> None:
    (package / "effects").mkdir()
    (package / "effects/__init__.py").write_text("def create(name): ...\n", "utf-8")
    (package / "own.py").write_text(own, "utf-8")
    effect = package / "effects/creep.py"
    without, one = digest(), digest(effect, "rate = 1\n")
    assert (one != without, digest(effect, "rate = 22\n") != one) == (counts, counts)


FACTS = """fact,of,values,unit,status,source,doi,place,note
usual_size,L4,1.5 2.5,mm,confirmed,Someone 1999,,Table 1,
usual_size,L5,1.5,mm,confirmed,Someone 1999,,Table 1,
usual_rate,,3,1/s,choice,own estimate,,,
"""


@pytest.mark.parametrize(
    ("was", "becomes", "counts"),
    [
        ("1.5 2.5", "1.5 2.6", True),
        ("L5", "L3", True),
        (",mm,", ",m,", True),
        ("usual_size,L5", "usual_width,L5", True),
        ("Someone 1999", "Another 2001", False),
        ("Table 1,", "Table 1,wider than others", False),
        ("choice", "from_memory", False),
        ("usual_rate,,3", "usual_rate,,4", False),
    ],
)
def test_of_facts_the_named_ones_count_without_their_sources(
    package: Path, was: str, becomes: str, counts: bool
) -> None:
    (package / "used/it.py").write_text("x = numbers(__name__, 'usual_size')\n", "utf-8")
    assert was in FACTS
    file = package / "used/facts.csv"
    assert (digest(file, FACTS) != digest(file, FACTS.replace(was, becomes))) is counts


FORM = """# Who takes part.
persons:
  row: person
  columns:
    person: {type: text, key: true, meaning: "who, by name"}
    called: {low: 0, meaning: how often somebody called}
    sex: {type: text, allowed: [male, female], otherwise: write it out}
  rules:
    - together: [called, sex]
      found: one of two
      allowed: both or none
      remedy: fill it
"""


@pytest.mark.parametrize(
    ("was", "becomes", "counts"),
    [
        ("# Who", "# Those who", False),
        ("row: person", "row: one person", False),
        ("who, by name", "name of a person", False),
        ("write it out", "correct it", False),
        ("one of two", "half", False),
        ("both or none", "two or none", False),
        ("remedy: fill it", "remedy: delete it", False),
        ("low: 0", "low: 1", True),
        ("    called: {", "    heard: {", True),
        ("male, female", "male", True),
        ("key: true", "key: false", True),
        ("[called, sex]", "[person, sex]", True),
        ("persons:", "people:", True),
    ],
)
def test_of_forms_columns_and_rules_count_without_words(
    package: Path, was: str, becomes: str, counts: bool
) -> None:
    assert was in FORM
    file = package / "used/forms.yaml"
    assert (digest(file, FORM) != digest(file, FORM.replace(was, becomes))) is counts
