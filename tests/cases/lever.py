"""A project with a cohort of one stiff joint without weight under a small force."""

from pathlib import Path

import pandas as pd
from small_project import Project, copy_project

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
    return project


def table(project: Project, study: str, name: str) -> pd.DataFrame:
    return pd.read_parquet(project.path(f"results/{study}/{name}.parquet"))
