"""A global sensitivity study through the whole workflow, its indices known in closed form.

One stiff joint without weight under a small force F at a point p: it extends by
(p_x F_y - p_y F_x) / k, linear in the point. With normal offsets of the point the shares of the
variance are (F_y s_x)^2 and (F_x s_y)^2 over their sum; nothing else moves the joint.
"""

from pathlib import Path

import pandas as pd
import pytest
from small_project import Project, copy_project

FORCE_N = (1.0, 2.0)
OFFSET_SD_MM = 5.0
SHARES = {"load_point_x": 0.8, "load_point_y": 0.2, "bending": 0.0, "dummy": 0.0}

STUDY = """\
study: {name}
kind: global_sensitivity
cohort: lever
factors:
  - {{of: load_point, axis: x, offset_mm: {{sd: 5}}}}
  - {{of: load_point, axis: y, offset_mm: {{sd: 5}}}}
  - {{of: stiffness, coordinate: right_bending, times: {{low: 0.5, high: 2}}, name: bending}}
design: {{method: sobol, samples: {samples}, second_order: false}}
outputs: {{motion: [extension], joint_load: [extension]}}
bootstraps: 200
{more}
"""


def lever(folder: Path, *studies: tuple[str, int, str]) -> Project:
    """A project with the cohort of one joint and these studies: name, samples, more lines."""
    project = copy_project(folder)
    cohort = project.path("config/cohorts/lever")
    cohort.mkdir()
    (cohort / "cohort.yaml").write_text(
        "cohort: lever\ntitle: one joint\nsource: written for the tests\n"
        "vertebrae: [V2, V1]\ngravity: false\n"
    )
    (cohort / "specimens.csv").write_text("specimen\na\nb\n")
    pose = "joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    rows = [f"{name},V1V2,0,0,0,0,0,0" for name in "ab"]
    (cohort / "joints.csv").write_text("\n".join([f"specimen,{pose}", *rows]) + "\n")
    x, y = FORCE_N
    (cohort / "loads.csv").write_text(
        "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm\n"
        f"*,push,0,V1,0,0,0,0,0,0,20,30,0\n*,push,1,V1,{x},{y},0,0,0,0,20,30,0\n"
    )
    for name, samples, more in studies:
        text = STUDY.format(name=name, samples=samples, more=more)
        project.path(f"config/studies/{name}.yaml").write_text(text)
    names = ", ".join(name for name, _, _ in studies)
    project.path("config/config.yaml").write_text(f"studies: [{names}]\n")
    return project


def table(project: Project, study: str, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{study}/{name}.parquet"))


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Two studies alike but for how many samples a job computes."""
    folder = tmp_path_factory.mktemp("lever") / "project"
    project = lever(folder, ("single", 64, ""), ("batches", 64, "samples_per_target: 50"))
    project.run_all()
    return project


def test_known_shares_lie_in_their_intervals(computed: Project) -> None:
    rows = table(computed, "single", "indices")
    assert set(rows["specimen"]) == {"a", "b"}
    assert set(rows["output"]) == {"motion", "joint_load"}
    assert (rows["status"] == "done").all()
    assert (rows["failed"] == 0).all()
    assert (rows["runs"] == 64 * (4 + 2)).all()
    for row in rows[rows["index"].isin(["S1", "ST"])].itertuples():
        expected = SHARES[row.factor]
        assert row.ci_low - 1e-3 <= expected <= row.ci_high + 1e-3, row
        assert row.estimate == pytest.approx(expected, abs=0.25)


def test_motion_is_the_lever_s(computed: Project) -> None:
    """Each run by hand: moment of the force about the joint over its stiffness, 51 N m/rad."""
    design = table(computed, "single", "design").pivot(
        index="sample", columns="factor", values="value"
    )
    responses = table(computed, "single", "responses")
    responses = responses[responses["specimen"] == "a"].set_index("sample")
    x = (20.0 + design["load_point_x"]) / 1000.0
    y = (30.0 + design["load_point_y"]) / 1000.0
    moment = x * FORCE_N[1] - y * FORCE_N[0]
    found = responses["load_extension_nm"].reindex(design.index)
    assert (found - moment).abs().max() < 2e-3 * moment.abs().max()
    motion = responses["predicted_extension_deg"].reindex(design.index)
    assert (motion - 57.29578 * found / 51.0).abs().max() < 1e-9


def test_samples_per_target_change_no_row(computed: Project) -> None:
    jobs = "jobs/responses/specimen=a"
    count = {
        name: len(list(computed.path(f"results/{name}/{jobs}").glob("*.parquet")))
        for name in ("single", "batches")
    }
    assert count == {"single": 384, "batches": 8}
    for name in ("design", "responses", "indices", "convergence"):
        one, other = (table(computed, study, name) for study in ("single", "batches"))
        pd.testing.assert_frame_equal(one, other)


def test_a_lost_sample_is_computed_again_and_nothing_else_changes(
    computed: Project, tmp_path: Path
) -> None:
    project = lever(tmp_path / "project", ("single", 64, ""))
    done = project.snakemake("-j1", "all")
    assert done.returncode == 0, done.stdout
    before, files = project.contents(), project.files()
    for name, content in before.items():
        if name.endswith("parquet"):  # made on one core, the other on two
            assert computed.path(f"results/{name}").read_bytes() == content, name
    lost = "single/jobs/responses/specimen=b/batch=00017.parquet"
    project.path(f"results/{lost}").unlink()
    project.run_all()
    after = project.files()
    assert after[lost] != files[lost]
    others = {name for name in files if "/jobs/" in name and name != lost}
    assert all(after[name] == files[name] for name in others)
    assert project.contents() == before
