"""A project with a cohort of one stiff joint without weight under a small force."""

from pathlib import Path
from typing import Any

import pandas as pd
from small_project import Project, copy_project

from spinepipe.jobs.collect import join_files
from spinepipe.jobs.expected import Expected, place_of
from spinepipe.studies.global_sensitivity import analyse, base, calibrate, design, respond
from spinepipe.studies.global_sensitivity.kind import KIND, SensitivityFiles
from spinepipe.studies.read import check
from spinepipe.tables import read_frame

FORCE_N = (1.0, 2.0)
POINT_MM = (20.0, 30.0)
MEASURED_DEG = 0.01
"""Extension that the joint is said to have shown."""

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
    write_lever(project, *studies)
    return project


def write_lever(project: Project, *studies: tuple[str, int, str]) -> None:
    """Write the cohort and the studies into a project."""
    cohort = project.path("config/cohorts/lever")
    cohort.mkdir(parents=True, exist_ok=True)
    project.path("config/studies").mkdir(exist_ok=True)
    (cohort / "cohort.yaml").write_text(
        "cohort: lever\ntitle: one joint\nsource: written for the tests\n"
        "vertebrae: [V2, V1]\ngravity: false\n"
    )
    (cohort / "specimens.csv").write_text("specimen\na\nb\n")
    pose = "joint,x_mm,y_mm,z_mm,extension_deg,right_bending_deg,left_rotation_deg"
    rows = [f"{name},V1V2,0,0,0,0,0,0" for name in "ab"]
    (cohort / "joints.csv").write_text("\n".join([f"specimen,{pose}", *rows]) + "\n")
    (x, y), (at_x, at_y) = FORCE_N, POINT_MM
    (cohort / "loads.csv").write_text(
        "specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm\n"
        f"*,push,0,V1,0,0,0,0,0,0,{at_x},{at_y},0\n"
        f"*,push,1,V1,{x},{y},0,0,0,0,{at_x},{at_y},0\n"
    )
    (cohort / "motion.csv").write_text(
        "specimen,test,step,joint,extension_deg\n"
        + "".join(f"{n},push,0,V1V2,\n{n},push,1,V1V2,{MEASURED_DEG}\n" for n in "ab")
    )
    for name, samples, more in studies:
        text = STUDY.format(name=name, samples=samples, more=more)
        project.path(f"config/studies/{name}.yaml").write_text(text)
    names = ", ".join(name for name, _, _ in studies)
    project.path("config/config.yaml").write_text(f"studies: [{names}]\n")


def table(project: Project, study: str, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{study}/{name}.parquet"))


def tables_of(root: Path, study: str) -> dict[str, pd.DataFrame]:
    """Tables of specimen a, its jobs run one after the other in this process."""
    told = Expected(str(root), *check(root, study))
    files = told.files
    assert isinstance(files, SensitivityFiles)

    def path(name: str) -> str:
        return str(root / name)

    drawn = path(f"{files.folder}/design.parquet")
    design.run(str(root), study, drawn)
    of_base = {
        name: path(files.job_files(name, "a", "000")[0])
        for name in ("base_stiffness", "base_motion")
    }
    base.run(str(root), study, "a", **of_base)
    start = [path(name) for name in files.base_of("a")]
    blocks: dict[str, Any] = {"responses": [], "calibrated": []}
    for table, job in (("responses", respond.run), ("calibrated", calibrate.run)):
        if table not in files.tables:
            continue
        for specimen, block in files.blocks(table):
            if specimen == "a":
                parts = [path(name) for name in files.job_files(table, specimen, block)]
                places = {part: place_of(part) for part in parts}
                job(str(root), study, drawn, "a", places, start)
                blocks[table].append(path(files.block_file(table, specimen, block)))
                marks = {part: told.of_part(table, part) for part in parts}
                join_files(KIND.table(table), marks, blocks[table][-1])
    names = ("indices", "convergence", "failed_runs")
    found = {name: path(f"{files.folder}/{name}.parquet") for name in names}
    analyse.run(str(root), study, drawn, **blocks, specimen="a", **found)
    joined = {
        name: pd.concat([read_frame(file) for file in made], ignore_index=True)
        for name, made in blocks.items()
        if made
    }
    whole = {"design": drawn, **of_base, **found}
    return joined | {name: read_frame(file) for name, file in whole.items()}
