"""A model file beneath a cohort study: its effects act in every model, besides the bushings.

Seen here: an effect that acts in fits and not in predictions, values of a specimen told of itself, a
file that does not fit and passes, a result that does not know its model.

Straight chains turn joint by joint, so the motion of a joint with k q + r q^3 is the root of a cubic.
"""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from chain_cases import JOINTS, MOMENT_OF, STUDY, Chains, Written, by_joint
from cohort_edge_cases import TRUTH, A
from example_effects import CubicStiffening, MarkerError
from scipy.optimize import brentq

from spinepipe.effects import register, registry
from spinepipe.jobs.digest import base_marks
from spinepipe.marks import write_marked
from spinepipe.problems import InputError
from spinepipe.studies import read as studies
from spinepipe.studies.cohort_stiffness.problem import SEEN
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

RISE = 2000.0
TESTS = ("flexion", "gentle_flexion")
FREE = "free: [extension]\nstarts: 1\n"
BASE = "base: {model: model.yaml}\n"
HEAD = "model: m\ncohort: chains\neffects:\n- effect: linear_bushing\n"
CUBIC = "- effect: cubic_for_a_test\n  values:\n"
FOR_ALL = f"{HEAD}{CUBIC}  - {{rise: {RISE}}}\n"


@pytest.fixture(autouse=True)
def own_effects_and_tests(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Two test effects, and a test that flexes a quarter as far."""
    monkeypatch.setattr(registry, "_CLASSES", dict(registry._CLASSES))
    register("cubic_for_a_test")(CubicStiffening)
    register("marker_for_a_test")(MarkerError)
    monkeypatch.setitem(MOMENT_OF, "gentle_flexion", ("mz_nm", -0.25, "extension"))
    monkeypatch.chdir(tmp_path)


def turned(moment: float, k: float, rise: float) -> float:
    """Degrees at which k q + rise q^3 is the moment."""
    return float(np.rad2deg(brentq(lambda q: k * q + rise * q**3 - moment, -1.0, 1.0, xtol=1e-14)))


def stiffening(
    root: Path,
    model: str | None,
    rises: Mapping[str, float] | None = None,
    noise_deg: float = 0.0,
    study: str = "",
) -> Written:
    """Three specimens whose joints stiffen in extension, and a study with that base."""
    head = FREE + study + (BASE if model else "")
    chains = Chains(TRUTH, TESTS, steps=5, step_nm=2.0, study=head)
    noise = noise_deg * np.random.default_rng(8).normal(size=len(chains.motion))
    rises = rises or dict.fromkeys(TRUTH, RISE)
    angles = [
        turned(
            MOMENT_OF[row.test][1] * 2.0 * row.step,
            TRUTH[row.specimen][JOINTS.index(row.joint)][0],
            rises[row.specimen],
        )
        for row in chains.motion.itertuples()
    ]
    chains.motion["extension_deg"] = np.array(angles) + noise
    root.mkdir(exist_ok=True)
    os.chdir(root)  # where commands are run; the test ends where it began
    if model:
        Path("model.yaml").write_text(model)
    return chains.write(root)


def rmse(found: Mapping[str, pd.DataFrame], stage: str) -> float:
    """Root mean square error of extension in deg of one stage, all tests and joints."""
    rows = found["errors"]
    rows = rows[(rows["stage"] == stage) & (rows["coordinate"] == "extension")]
    assert len(rows)
    return float(np.sqrt((rows["rmse"] ** 2).mean()))


def test_stiffness_is_that_of_the_bushing_once_the_effect_acts(tmp_path: Path) -> None:
    """Fits start at the published stiffness, whatever the file's bushing says, and free it."""
    model = FOR_ALL.replace("bushing\n", "bushing\n  values:\n  - {extension_nm_per_rad: 9.0}\n", 1)
    found = stiffening(tmp_path, model).fit("a", "per_joint")
    np.testing.assert_allclose(by_joint(found["stiffness"])["extension"], A[:, 0], rtol=1e-6)
    assert rmse(found, "fitted") < 1e-6


def held_out(project: Written) -> dict[str, float]:
    """Errors in deg of what each way of leaving out predicts of specimen a."""
    return {
        "load case": rmse(project.fit("a", "per_joint", "gentle_flexion"), "left_out_case"),
        "specimen": rmse(project.left_out("bc", "a", "per_joint"), "left_out_specimen"),
        "pooled specimen": rmse(project.pool(without="a"), "left_out_specimen"),
        "fitted": rmse(project.fit("a", "per_joint"), "fitted"),
    }


def test_the_effect_lowers_held_out_error(tmp_path: Path) -> None:
    """With noise of 0.1 deg; what is left over of a specimen is that its stiffness is its own."""
    alike = dict.fromkeys(TRUTH, RISE)
    without = held_out(stiffening(tmp_path / "without", None, alike, 0.1))
    beneath = held_out(stiffening(tmp_path / "with", FOR_ALL, alike, 0.1))
    assert beneath["load case"] < 0.25 * without["load case"]
    assert beneath["fitted"] < 1.2 * 0.1 < 3.0 * 0.1 < without["fitted"]
    for name in ("specimen", "pooled specimen"):
        assert beneath[name] < 0.7 * without[name]


def test_literature_too_is_predicted_with_the_effect(tmp_path: Path) -> None:
    rows = stiffening(tmp_path, FOR_ALL).literature("a")["errors"]
    rows = rows[(rows["representation"] == "literature") & (rows["test"] == "flexion")]
    rows = rows[rows["coordinate"] == "extension"].set_index("joint")
    for joint, k in zip(JOINTS, A[:, 0], strict=True):
        expected = turned(-8.0, 51.0, RISE) - turned(-8.0, k, RISE)
        assert rows.loc[joint, "peak_error"] == pytest.approx(expected, abs=1e-6)


def test_what_instruments_report_is_compared(tmp_path: Path) -> None:
    """A marker error is no motion: predictions are as the instruments would report them."""
    bias = f"- effect: marker_for_a_test\n  values:\n  - {{bias: {float(np.deg2rad(2.0))!r}}}\n"
    plain, seen = (
        stiffening(tmp_path / name, model).literature("a")["errors"]
        for name, model in (("plain", FOR_ALL), ("seen", FOR_ALL + bias))
    )
    extension = plain["coordinate"] == "extension"
    np.testing.assert_allclose((seen["bias"] - plain["bias"])[extension], 2.0, rtol=1e-9)
    np.testing.assert_allclose((seen["bias"] - plain["bias"])[~extension], 0.0, atol=1e-9)


RISES = {"a": 4000.0, "b": 1000.0, "c": 2000.0}
EACH = HEAD + CUBIC + "".join(f"  - {{specimen: {n}, rise: {r}}}\n" for n, r in RISES.items())
EACH_AND_ALL = EACH.replace("values:\n  - {s", "values:\n  - {rise: 2000.0}\n  - {s", 1)


@pytest.mark.parametrize("model", [EACH, EACH_AND_ALL])
def test_a_fit_uses_the_values_of_its_specimen(model: str, tmp_path: Path) -> None:
    project = stiffening(tmp_path, model, RISES)
    for specimen, k in TRUTH.items():
        found = project.fit(specimen, "per_joint")
        np.testing.assert_allclose(by_joint(found["stiffness"])["extension"], k[:, 0], rtol=1e-6)


@pytest.mark.parametrize(("model", "rise"), [(EACH, 4000.0), (EACH_AND_ALL, 2000.0)])
def test_a_left_out_specimen_has_the_values_of_all_where_there_are_such(
    model: str, rise: float, tmp_path: Path
) -> None:
    """The median of b and c is 1.15 times the stiffness of a."""
    project = stiffening(tmp_path, model, RISES)
    for found in (project.left_out("bc", "a", "per_joint"), project.pool(without="a")):
        rows = found["errors"][found["errors"]["test"] == "flexion"].set_index("joint")
        k = by_joint(found["stiffness"])["extension"]
        for joint, true in zip(JOINTS, A[:, 0], strict=True):
            expected = turned(-8.0, k[joint], rise) - turned(-8.0, true, RISES["a"])
            (error,) = rows[rows["coordinate"] == "extension"].loc[[joint], "peak_error"]
            assert error == pytest.approx(expected, abs=1e-6)
        said = found["stiffness"]["message"].str.contains(SEEN, regex=False)
        assert said.all() if model == EACH else not said.any()


def test_every_file_tells_which_model_it_was_made_with(tmp_path: Path) -> None:
    project = stiffening(tmp_path, FOR_ALL)
    project.fit("a", "per_specimen")
    told = pq.read_schema(tmp_path / "errors.parquet").metadata[b"base_model_digest"]
    assert told.decode() == hashlib.sha256(FOR_ALL.encode()).hexdigest()
    Path("model.yaml").write_text(FOR_ALL.replace("2000.0", "900.0"))
    rows = project.fit("a", "per_joint")["stiffness"]
    assert (by_joint(rows)["extension"] > 1.05 * A[:, 0]).all()


def test_a_given_file_counts_by_its_content_one_that_is_made_by_its_mark(tmp_path: Path) -> None:
    model, root = tmp_path / "model.yaml", str(tmp_path)
    seen = []
    for content in (FOR_ALL, EACH):
        write_marked(content, model, "a" * 64)
        seen.append(base_marks(root, "model.yaml"))
    assert seen[0][0] != seen[1][0]
    assert seen[0][1:] == seen[1][1:]  # digests of the effects that both name
    assert base_marks(root, str(model)) == seen[1]
    (tmp_path / "config/studies").mkdir(parents=True)
    (tmp_path / "config/studies/other.yaml").touch()
    write_marked(EACH, tmp_path / "results/other/discrepancy/m.yaml", "b" * 64)
    for path in ("results/other/discrepancy/m.yaml", "./results/other/discrepancy/m.yaml"):
        assert base_marks(root, path) == ["b" * 64]
    assert base_marks(root, None) == []


def complaints(root: Path, model: str, name: str = "model.yaml") -> list[str]:
    stiffening(root, model).root.joinpath(f"config/studies/{STUDY}.yaml").write_text(
        f"study: {STUDY}\nkind: cohort_stiffness\ncohort: chains\nbase: {{model: {name}}}\n"
    )
    with pytest.raises(InputError) as caught:
        studies.check(root, STUDY)
    return [str(problem) for problem in caught.value.problems]


# fmt: off
# ruff: noqa: E501
FAULTS = [
    (FOR_ALL.replace("cubic_for", "cubik_for"), "effects.1", "unknown effect 'cubik_for_a_test'"),
    (FOR_ALL.replace("{rise", "{joint: L1L2, rise"), "effects.1.values.joint", "found L1L2; allowed: *, L5S1, L4L5, L3L4"),
    (f"{FOR_ALL}  - {{specimen: d, rise: 5.0}}\n", "effects.1.values.specimen", "unknown specimen 'd'"),
    (FOR_ALL.replace("{rise", "{specimen: a, rise"), "effects.1.values", "no value for b, c"),
    (FOR_ALL.replace("  values", "  scope: {specimens: [x]}\n  values"), "effects.1.scope.specimens", "unknown specimen 'x'"),
    (FOR_ALL.replace("  values", "  scope: {tests: [flexon]}\n  values"), "effects.1.scope.tests", "did you mean 'flexion'"),
    (FOR_ALL.replace("effect: linear_bushing\n", "effect: linear_bushing\n  scope: {tests: [flexon]}\n", 1), "effects.0.scope.tests", "did you mean 'flexion'"),
    (FOR_ALL.replace("2000.0", "-1.0"), "effects.1.values.rise", "found -1.0"),
    ("effects: [", "model.yaml", "no YAML"),
    (HEAD.replace("- effect: linear_bushing\n", f"{CUBIC}  - {{rise: 5.0}}\n- effect: linear_bushing\n"), "effects.0", "move linear_bushing to the top"),
]
# fmt: on


def test_a_file_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    for number, (model, place, says) in enumerate(FAULTS):
        (told,) = complaints(tmp_path / str(number), model)
        assert told.startswith("model.yaml")
        assert place in told
        assert says in told
    two = FOR_ALL.replace("  values", "  scope: {tests: [flexon], specimens: [x]}\n  values")
    assert len(complaints(tmp_path / "two", two)) == 2


def test_paths_count_from_the_project_wherever_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stiffening(tmp_path / "project", FOR_ALL)
    monkeypatch.chdir(tmp_path)
    study, _ = studies.check(tmp_path / "project", STUDY)
    assert isinstance(study, CohortStiffness)
    assert study.base is not None
    assert study.base.model == "model.yaml"


def test_a_missing_file_is_told_with_its_line(tmp_path: Path) -> None:
    (told,) = complaints(tmp_path, FOR_ALL, "modell.yaml")
    assert f"{STUDY}.yaml, line 4, base.model: found no file 'modell.yaml'" in told
    (told,) = complaints(tmp_path / "two", FOR_ALL, "results/nobody/model.yaml")
    assert "found no file" in told


def test_a_result_of_another_study_may_still_be_missing_but_not_wrong(tmp_path: Path) -> None:
    path = tmp_path / "results/other/discrepancy/model_with_effects.yaml"
    project = stiffening(tmp_path, FOR_ALL, study="")
    (tmp_path / "config/studies/other.yaml").touch()
    file = project.root / f"config/studies/{STUDY}.yaml"
    file.write_text(file.read_text().replace("model.yaml", path.relative_to(tmp_path).as_posix()))
    study, _ = studies.check(tmp_path, STUDY)
    assert study.base is not None
    path.parent.mkdir(parents=True)
    path.write_text(FOR_ALL.replace("cubic_for", "cubik_for"))
    with pytest.raises(InputError, match="delete the file, and study other makes it anew"):
        studies.check(tmp_path, STUDY)


def test_a_file_of_bushings_alone_changes_nothing(tmp_path: Path) -> None:
    plain = stiffening(tmp_path / "plain", None).fit("a", "per_joint")["stiffness"]
    bushings = stiffening(tmp_path / "bushings", HEAD).fit("a", "per_joint")["stiffness"]
    pd.testing.assert_frame_equal(plain, bushings)
