# The front door: which studies are computed. What is computed of each: workflow/rules.
import sys

from snakemake.utils import min_version

min_version("9.27")
sys.path.insert(0, workflow.basedir)


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/execution.smk"


STUDIES = selected_studies()


wildcard_constraints:
    study="[a-z0-9_]+",
    specimen="[^/=]+",
    pose="[0-9]{4}",
    stiffness="calibrated|best[0-9]{2}",
    table="calibrations|simulations",
    block="[0-9]{3}",


include: "workflow/rules/joint_pose_sensitivity.smk"


rule all:
    default_target: True
    input:
        [
            path
            for name in STUDIES
            for path in layout(name).results() + layout(name).lost()
        ],


onstart:
    check_engine()
    check_writable(STUDIES)
    drop_job_chatter()


onsuccess:
    say_where(STUDIES)
