"""The archive of a study: whole, the same each time, and of no results but those of the study.

Catches stale or damaged results in a paper's supplement, an input that is missing there without a
word, and a file from elsewhere on the disk that is in it.
"""

import base64
import json
import os
import re
import shutil
from hashlib import sha256
from pathlib import Path
from zipfile import ZipFile

import pyarrow as pa
import pytest
from study_cases import STUDY, Size, project

from spinepipe.cli import main
from spinepipe.cli.archive import _inputs, _packages
from spinepipe.jobs.digest import versions
from spinepipe.jobs.expected import Expected
from spinepipe.jobs.project import RUNNING, lock
from spinepipe.marks import KEY, with_mark, write_marked
from spinepipe.model.file import EffectEntry, ModelFile, write_model
from spinepipe.muscles.myo_sim import PACKAGE, VERSION
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.tables import write

ROOT = Path(__file__).resolve().parents[2]
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg=="
)


def written(root: Path, full: bool = False) -> Expected:
    """Files with the marks of results, whatever else is in them."""
    expected = Expected(str(root), *studies.check(root, STUDY))
    for name in expected.files.results(full):
        path, mark = root / name, expected.of_file(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".parquet":
            write(pa.table({"of": [name]}), path, {KEY: mark, "code_digest": "c0de", **versions()})
        elif path.suffix == ".json":
            path.write_text(json.dumps(with_mark({"of": name}, mark)))
        else:
            write_marked(PNG if path.suffix == ".png" else f"{name}\n", path, mark)
    return expected


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project whose study was computed."""
    root = project(tmp_path / "project", Size())
    (root / "spinepipe").symlink_to(ROOT / "spinepipe")  # captions of figures
    written(root)
    return root


def archive(root: Path, output: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit code, and what was said on both streams."""
    code = main(["--root", str(root), "archive", STUDY, "-o", str(output)])
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    return code, told.out + told.err


def contents(output: Path) -> dict[str, str]:
    """Texts of the files in an archive, by name without its folder; nothing of others."""
    with ZipFile(output) as file:
        assert file.testzip() is None
        found = {info.filename: file.read(info) for info in file.infolist()}
        assert all(info.date_time == (1980, 1, 1, 0, 0, 0) for info in file.infolist())
    assert {name.split("/")[0] for name in found} == {STUDY}
    return {
        name.removeprefix(f"{STUDY}/"): raw.decode(errors="replace") for name, raw in found.items()
    }


def test_all_that_went_in_and_came_out_and_nothing_else(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("jobs/specimen-a/x.parquet", "blocks/x.parquet", "logs/x.log", ".left.json.1"):
        (root / "results" / STUDY / name).parent.mkdir(parents=True, exist_ok=True)
        (root / "results" / STUDY / name).write_text("no result")
    (root / "config/cohorts/straight/.#loads.csv").write_text("an editor's")
    (root / "config/cohorts/straight/notes.txt").write_text("a note")
    code, told = archive(root, tmp_path / "a.zip", capsys)
    assert code == 0, told
    found = contents(tmp_path / "a.zip")
    inputs = {
        "cohort.yaml",
        *(f"{name}.csv" for name in ("specimens", "landmarks", "loads", "motion")),
    }
    assert set(found) == {
        *("README.txt", "requirements.lock", "config/config.yaml", f"config/studies/{STUDY}.yaml"),
        *(f"config/cohorts/straight/{name}" for name in (*inputs, "notes.txt")),
        *Expected(str(root), *studies.check(root, STUDY)).files.results(),
        f"results/{STUDY}/datapackage.json",
    }
    assert found["config/config.yaml"] == f"studies: [{STUDY}]\n"
    assert '"calibrations.parquet"' in found[f"results/{STUDY}/datapackage.json"]
    readme = found["README.txt"]
    assert "Source of the data: written for the tests" in readme
    assert "run `make` (" in readme
    assert f"numpy: {versions()['version_numpy']}" in readme
    assert "calibrations  c0de" in readme
    assert "NOT IN HERE" not in readme
    listed = dict(line.split("  ")[::-1] for line in readme.split("FILES")[1].splitlines()[1:])
    assert set(listed) == set(found) - {"README.txt"}
    loads = root / "config/cohorts/straight/loads.csv"
    assert listed["config/cohorts/straight/loads.csv"] == sha256(loads.read_bytes()).hexdigest()


def test_the_same_files_give_the_same_bytes(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert archive(root, tmp_path / "a.zip", capsys)[0] == 0
    for path in (path for part in ("config", "results") for path in (root / part).rglob("*.*")):
        os.utime(path, (1e9, 1e9))
    within = root / "config/cohorts/straight/a.zip"
    for _ in range(2):  # an archive does not hold itself
        assert archive(root, within, capsys)[0] == 0
        assert within.read_bytes() == (tmp_path / "a.zip").read_bytes()


def test_what_full_adds_is_in_it_where_it_is_there(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    added = set(written(root, full=True).files.results(full=True))
    code, told = archive(root, tmp_path / "a.zip", capsys)
    assert code == 0, told
    found = contents(tmp_path / "a.zip")
    assert added <= set(found)
    assert "run `make full` (" in found["README.txt"]


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        ("lose", f"results/{STUDY}/report.html: found no such file"),
        ("damage", f"results/{STUDY}/poses.parquet: found a damaged file"),
        ("study", "found a result of other settings, data or code"),
        ("cohort", "found a result of other settings, data or code"),
        ("run", f"{RUNNING}: found a run at work: process"),
        ("name", "-o: found a.tar; allowed: FILE.zip"),
    ],
)
def test_it_refuses_in_a_sentence(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], spoil: str, told: str
) -> None:
    results, output, held = root / "results" / STUDY, tmp_path / "a.zip", None
    if spoil == "lose":
        (results / "report.html").unlink()
    elif spoil == "damage":
        raw = bytearray((results / "poses.parquet").read_bytes())
        raw[10] ^= 1
        (results / "poses.parquet").write_bytes(raw)
    elif spoil == "study":
        path = root / f"config/studies/{STUDY}.yaml"
        path.write_text(path.read_text().replace("poses: 12", "poses: 13"))
    elif spoil == "cohort":
        path = root / "config/cohorts/straight/motion.csv"
        path.write_text(path.read_text().replace("-1.5", "-1.6"))
    elif spoil == "run":
        (root / ".snakemake").mkdir()
        held = lock(root / RUNNING)
    else:
        output = tmp_path / "a.tar"
    code, said = archive(root, output, capsys)
    assert code == 1
    assert told in said
    assert len(said.splitlines()) == 2
    if spoil in ("lose", "damage", "study", "cohort"):
        assert f"run `make` with {STUDY} among the studies of config/config.yaml" in said
    assert not output.exists()
    if held:
        held.close()
        assert archive(root, output, capsys)[0] == 0


@pytest.mark.parametrize("linked", [False, True])
def test_data_outside_of_the_project_are_named_with_their_digests(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], linked: bool
) -> None:
    cohort, moved = root / "config/cohorts/straight", tmp_path / "straight"
    cohort.rename(moved)
    shown = "config/cohorts/straight"
    if linked:
        cohort.symlink_to(moved)
    else:
        shown, path = "../straight", root / f"config/studies/{STUDY}.yaml"
        path.write_text(path.read_text().replace("cohort: straight", f"cohort: {shown}"))
        written(root)
    code, told = archive(root, tmp_path / "a.zip", capsys)
    assert code == 0, told
    assert "5 inputs left out (README.txt says which)" in told
    found = contents(tmp_path / "a.zip")
    assert not [name for name in found if "motion.csv" in name]
    digest = sha256((moved / "motion.csv").read_bytes()).hexdigest()
    assert f"\n{digest}  {shown}/motion.csv\n" in found["README.txt"]
    assert str(tmp_path) not in found["README.txt"]


def test_a_model_that_another_study_made_comes_with_what_it_was_made_of(tmp_path: Path) -> None:
    """It is refused where it is not as that study makes it now."""
    for part in ("cohorts/stiffening_spines", "studies"):
        shutil.copytree(ROOT / "config" / part, tmp_path / "config" / part)
    name = "stiffening_spines"
    maker = Expected(str(tmp_path), *studies.check(tmp_path, name))
    model = f"{maker.files.folder}/model_with_effects.yaml"
    (tmp_path / model).parent.mkdir(parents=True)
    whole = ModelFile(model="m", cohort=name, effects=(EffectEntry(effect="linear_bushing"),))
    write_model(whole, tmp_path / model, maker.of_file(model))

    def inputs() -> set[str]:
        study = Expected(str(tmp_path), *studies.check(tmp_path, f"{name}_stiffness"))
        return {path.relative_to(tmp_path).as_posix() for path in _inputs(study)}

    of_cohort = (tmp_path / "config/cohorts" / name).iterdir()
    assert inputs() == {
        *(f"config/cohorts/{name}/{path.name}" for path in of_cohort),
        *(f"config/studies/{name}.yaml", f"config/studies/{name}_stiffness.yaml", model),
    }
    with (tmp_path / f"config/studies/{name}.yaml").open("a") as file:
        file.write("seed: 77\n")
    with pytest.raises(InputError, match=r"model_with_effects.yaml: found a result of other"):
        inputs()


def test_data_of_an_installed_package_are_named() -> None:
    study, _ = studies.check(ROOT, "trunk_volunteers", starting=False)
    assert [line.partition("  ")[2] for line in _packages(study)] == [
        f"the models of the package {PACKAGE} {VERSION}"
    ]


def test_the_commit_of_the_code_is_told(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Or why it is not, as of a copy without its history."""
    assert archive(root, tmp_path / "a.zip", capsys)[0] == 0
    readme = contents(tmp_path / "a.zip")["README.txt"]
    known = re.search(r"\ncommit [0-9a-f]{40}, (unchanged|with these changes:)\n", readme)
    assert known or "The commit is not known" in readme
