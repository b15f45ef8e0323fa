"""What people have made with an older version stays readable (`tests/frozen`).

What would be caught: a key of a study file, a column of a cohort or of a table, an entry of a
model file that is renamed, removed or read as another type, without a word to whoever has it.
"""

from pathlib import Path

import pytest

from spinepipe.marks import read_json
from spinepipe.model.file import read_model
from spinepipe.studies.read import check
from spinepipe.studies.registry import kind_names, kind_of
from spinepipe.tables import arrow_schema, read, read_frame, read_metadata

FROZEN = Path(__file__).parents[1] / "frozen"
VERSIONS = sorted(path.name for path in FROZEN.iterdir())
RENAMED: dict[str, str] = {}
"""``kind/table`` or ``kind/table.column`` of an old file, and what it is called now."""


def results(version: str, kind: str, pattern: str) -> list[Path]:
    return sorted((FROZEN / version / kind / "results").rglob(pattern))


def test_each_kind_is_there() -> None:
    assert "9b50b1f" in VERSIONS
    assert {path.name for path in (FROZEN / "9b50b1f").iterdir()} == {*kind_names(), "README.md"}


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", kind_names())
def test_cohort_and_study_are_sound(version: str, kind: str) -> None:
    root = FROZEN / version / kind
    (file,) = (root / "config/studies").iterdir()
    study, cohort = check(root, file.stem, starting=False)
    assert study.kind == kind
    assert cohort.specimen_names


@pytest.mark.parametrize("version", VERSIONS)
def test_models_and_verdicts_are_read(version: str) -> None:
    models = {
        kind: [read_model(path) for path in results(version, kind, "model*.yaml")]
        for kind in kind_names()
    }
    assert {kind for kind, found in models.items() if found} == {
        "discrepancy",
        "joint_pose_sensitivity",
    }
    named = [one.effect for model in models["discrepancy"] for one in model.effects]
    assert "nonlinear_stiffening" in named
    (verdict,) = results(version, "discrepancy", "verdict.json")
    assert read_json(verdict)["verdict"] == "NAMED"


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", kind_names())
def test_tables_are_read_and_their_columns_known(version: str, kind: str) -> None:
    unknown = []
    known = {table.name: arrow_schema(table) for table in kind_of(kind).tables}
    files = results(version, kind, "*.parquet")
    assert files
    for path in files:
        rows, name = read(path), f"{kind}/{path.stem}"
        assert len(read_frame(path)) == rows.num_rows
        assert read_metadata(path)["kind"] == kind
        if path.stem not in known:
            unknown += [name] * (name not in RENAMED)
            continue
        schema = known[path.stem]
        for field in rows.schema:
            place = f"{name}.{field.name}"
            if field.name not in schema.names:
                unknown += [place] * (place not in RENAMED)
            elif schema.field(field.name).type != field.type:
                unknown.append(f"{place}, which is of another type now")
    assert not unknown, f"say what these are called now, here and to whoever reads them: {unknown}"
