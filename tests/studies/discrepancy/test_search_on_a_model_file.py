"""A search that starts from a model file: what the file says of whom is kept in what is written."""

import json
from pathlib import Path

import pytest
from chain_cases import JOINTS, STUDY
from discrepancy_cases import SPECIMENS, files_of_a_search, project

from spinepipe.model.file import effects_for, read_model
from spinepipe.studies.discrepancy import job as search

MODEL = """\
model: given
cohort: chains
effects:
- effect: linear_bushing
- effect: local_laxity
  scope: {specimens: [b], joints: [L4L5]}
  values:
  - {fraction: 0.2}
- effect: facet_contact
  scope: {specimens: [a, b]}
- effect: marker_bias
  scope: {specimens: [c]}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a search for one effect alone, beside what the file has."""
    root = tmp_path_factory.mktemp("on_a_file")
    (root / "given.yaml").write_text(MODEL)
    lines = f"base: {{model: {root / 'given.yaml'}}}\neffects: [hysteresis]\nbootstrap: 100\n"
    made = project(root, lines) / "results" / STUDY / "discrepancy"
    made.mkdir(parents=True)
    search.run(str(root), STUDY, **files_of_a_search(made))
    return made


def test_each_specimen_keeps_the_effects_of_the_base(folder: Path) -> None:
    expected = {
        "a": ["linear_bushing", "facet_contact"],
        "b": ["linear_bushing", "local_laxity", "facet_contact"],
        "c": ["linear_bushing", "marker_bias"],
    }
    for name in ("model_base", "model_with_effects"):
        model = read_model(folder / f"{name}.yaml")
        for specimen in SPECIMENS:
            found = [one.effect.name for one in effects_for(model, specimen, JOINTS)]
            assert found[: len(expected[specimen])] == expected[specimen]
    lax = effects_for(read_model(folder / "model_base.yaml"), "b", JOINTS)[1]
    assert (lax.joints, lax.values.tolist()) == ((JOINTS.index("L4L5"),), [[0.2]])


def test_one_effect_may_be_tried_alone(folder: Path) -> None:
    verdict = json.loads((folder / "verdict.json").read_text())
    assert verdict["verdict"] in ("NULL", "NAMED", "UNKNOWN")
