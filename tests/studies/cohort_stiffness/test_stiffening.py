"""Laws that stiffen: found where joints do, not claimed where they do not.

Truth in closed form: a joint that holds ``k (exp(b |q|) - 1) / b`` turns by ``log(1 + b M/k) / b``.
"""

from pathlib import Path

import numpy as np
import pytest
from chain_cases import STUDY, Chains, Written, by_joint
from cohort_analysis_cases import analysed
from cohort_edge_cases import A as K
from cohort_edge_cases import joined_jobs

from spinepipe.problems import InputError
from spinepipe.studies.cohort_stiffness.conclusions_of_claims import claim_conclusions
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import joint_values
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.read import check, read

B = np.array([[8.0, 6.0, 20.0], [10.0, 5.0, 15.0], [6.0, 9.0, 30.0]])
SPECIMENS = {"a": 1.0, "b": 0.8, "c": 1.5, "d": 1.2, "e": 0.9}
PER_JOINT = "per_joint_stiffening"
TESTS = ("flexion", "left_lateral_bending", "left_axial_rotation")
ASKED = ("per_specimen", "stiffening", "per_joint_stiffening", "pooled_stiffening")
STIFFENS = f"representations: [{', '.join(ASKED)}]\nstarts: 1\n"


def cohort(growth: float, noise_deg: float, specimens: int = 5, steps: int = 6) -> Chains:
    """Specimens that are stiffer than each other alike; growth in shares of `B`, 0 linear."""
    names = list(SPECIMENS)[:specimens]
    return Chains(
        {name: SPECIMENS[name] * K for name in names},
        steps=steps,
        step_nm=1.5,
        noise_deg=noise_deg,
        study=STIFFENS,
        growth=dict.fromkeys(names, growth * B) if growth else {},
    )


@pytest.mark.parametrize("representation", ["per_joint_stiffening", "pooled_stiffening"])
def test_each_law_is_found_from_motion_without_noise(representation: str, tmp_path: Path) -> None:
    project = cohort(1.0, 0.0, specimens=2, steps=4).write(tmp_path)
    pooled = representation == "pooled_stiffening"
    found = (
        project.pool(representation=representation) if pooled else project.fit("a", representation)
    )
    stiffness = found["stiffness"]
    if pooled:
        stiffness = stiffness[stiffness["specimen"] == "a"]
    # |q| is rounded over 1e-4 rad, and a joint turns by 0.007 to 0.08
    names = ["extension", "right_bending", "left_rotation"]
    np.testing.assert_allclose(by_joint(stiffness)[names], K, rtol=5e-3)
    np.testing.assert_allclose(by_joint(stiffness, "growth")[names], B, rtol=5e-2)
    assert set(stiffness["growth_unit"]) == {"1/rad"}
    assert (found["errors"]["rmse"] < 2e-3).all()
    if not pooled:
        assert found["fits"]["unknowns"].item() == 18
        assert stiffness["growth_identifiable"].all()
        assert not stiffness["growth_open_below"].any()


def test_the_spread_of_growth_over_a_cohort_is_that_of_the_truth(tmp_path: Path) -> None:
    """Growth differs between levels alone: means and SDs of the columns of the truth."""
    spread = cohort(1.0, 0.02, specimens=4).write(tmp_path).pool(representation="pooled_stiffening")
    rows = spread["pooling"].set_index("coordinate")
    for column, name in enumerate(("extension", "right_bending")):
        levels = B[:, column]
        assert rows.loc[name, "growth_centre"] == pytest.approx(levels.mean(), rel=0.1)
        assert levels.std() < rows.loc[name, "growth_between_levels"] < 3.0 * levels.std(ddof=1)
        assert rows.loc[name, "growth_between_joints"] < 0.5 * levels.std()


def test_a_linear_joint_is_told_to_be_open_below(tmp_path: Path) -> None:
    found = cohort(0.0, 0.05, specimens=1).write(tmp_path).fit("a", "per_joint_stiffening")
    rows = found["stiffness"]
    assert rows["growth_open_below"].mean() > 0.7  # each is wrong in 2.5 % by chance
    assert (rows.loc[rows["growth_open_below"], "growth_low"] == 0.0).all()
    assert not rows.loc[rows["growth_open_below"], "growth_identifiable"].any()


def test_a_left_out_specimen_gets_the_medians_of_both(tmp_path: Path) -> None:
    project = cohort(1.0, 0.0, specimens=4, steps=4).write(tmp_path)
    rows = project.left_out(["b", "c", "d"], "a", "stiffening")["stiffness"]
    own = [project.fit(name, "stiffening")["stiffness"] for name in "bcd"]
    for value in ("stiffness", "growth"):
        expected = np.median([by_joint(one, value) for one in own], axis=0)
        np.testing.assert_allclose(by_joint(rows, value), expected, rtol=1e-9)
    assert rows["growth_identifiable"].isna().all()


def test_what_no_reading_tells_of_has_no_law(tmp_path: Path) -> None:
    """Bending tells nothing of extension and rotation: their laws must not be a start value."""
    project = cohort(1.0, 0.02, specimens=2, steps=4).write(tmp_path)
    for found in (
        project.fit("a", "stiffening", "left_lateral_bending"),
        project.pool("left_lateral_bending", representation="pooled_stiffening"),
    ):
        rows = found["stiffness"].set_index("coordinate")
        silent = rows.loc[
            ["extension", "left_rotation"], ["stiffness", "growth", "growth_at_bound"]
        ]
        assert silent.isna().all(axis=None)
        assert (rows.loc["right_bending", "growth"] > 1.0).all()


def test_a_growth_of_zero_is_a_linear_joint_and_no_bound_of_stiffness(tmp_path: Path) -> None:
    """Joints that soften: growth ends at zero, which is told as linear."""
    softening = cohort(0.0, 0.0, specimens=2)
    softening.motion["extension_deg"] *= 1.0 + 0.2 * softening.motion["step"] / 5.0
    project = softening.write(tmp_path)
    for found in (project.fit("a", "stiffening"), project.pool(representation="pooled_stiffening")):
        extension = found["stiffness"][found["stiffness"]["coordinate"] == "extension"]
        assert (extension["growth"] == 0.0).all()
        assert set(extension["growth_at_bound"]) == {"lower"}
        assert set(found["fits"]["status"]) == {"converged"}
        assert found["fits"]["message"].str.contains("linear: ").all()


def alike(growth: float) -> Chains:
    """A cohort in which joints of a specimen are alike, so that only stiffening is at stake."""
    flat = {name: np.tile(K.mean(axis=0), (3, 1)) * SPECIMENS[name] ** 0.1 for name in SPECIMENS}
    rates = {name: growth * np.tile(B.mean(axis=0), (3, 1)) for name in SPECIMENS}
    study = "representations: [per_specimen, stiffening]\nfree: [extension]\nstarts: 1\n"
    chosen = rates if growth else {}
    tests = ["flexion"]
    return Chains(flat, tests, steps=6, step_nm=1.5, noise_deg=0.05, study=study, growth=chosen)


@pytest.mark.parametrize(("growth", "wins"), [(1.0, True), (0.0, False)])
def test_stiffening_wins_where_joints_stiffen_and_only_there(
    growth: float, wins: bool, tmp_path: Path
) -> None:
    study = read(alike(growth).write(tmp_path).root / "config/studies" / f"{STUDY}.yaml", tmp_path)
    assert isinstance(study, CohortStiffness)
    laws = ("per_specimen", "stiffening")
    frames = joined_jobs(Written(tmp_path), list(SPECIMENS), laws, ["flexion"])
    frames |= analysed(frames)
    findings = frames["findings"].set_index("finding")
    claim = findings.loc["stiffening_beats_per_specimen_left_out_specimen"]
    assert (claim["holds"] == "yes") is wins
    best = frames["ranking"]
    best = best[(best["criterion"] == "aicc") & (best["rank"] == 1)]["representation"].item()
    assert best == ("stiffening" if wins else "per_specimen")
    told = claim_conclusions(study, joint_values(frames["stiffness"]), frames["findings"])
    verdicts = {one.rule: one.verdict for one in told}
    assert verdicts["laws"] == ("better" if wins else "not_shown")


@pytest.mark.parametrize("label", ["left_lateral_bending", "all_but_flexion"])
def test_laws_of_which_little_is_told_still_converge(label: str, tmp_path: Path) -> None:
    """Most growths end on a bound: a search that keeps inside bounds would crawl there."""
    project = cohort(0.3, 0.05, specimens=1, steps=4).write(tmp_path)
    found = project.fit("a", PER_JOINT, label)["fits"]
    assert found["status"].item() in ("converged", "converged_at_bound")
    assert found["evaluations"].item() < 60


def test_a_base_model_that_stiffens_leaves_nothing_to_such_a_representation(
    tmp_path: Path,
) -> None:
    model = (
        "model: probe\ncohort: chains\neffects:\n- effect: linear_bushing\n"
        "- effect: nonlinear_stiffening\n  options: {coordinate: extension}\n"
        "  values:\n  - {rate: 5.0}\n"
    )
    (tmp_path / "model.yaml").write_text(model)
    chains = cohort(0.0, 0.0, specimens=1)
    chains.study += "base: {model: model.yaml}\n"
    root = chains.write(tmp_path).root
    with pytest.raises(InputError, match="two laws that scale one bushing"):
        check(root, STUDY)
