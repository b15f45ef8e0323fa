# The front door: what is computed, from which studies. Rules live in workflow/rules.
import sys

from snakemake.utils import min_version

min_version("9.27")
sys.path.insert(0, workflow.basedir)


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"


STUDIES = selected_studies()


wildcard_constraints:
    study="[a-z0-9_]+",
    specimen="[^/=]+",
    pose="[0-9]{4}",
    stiffness="calibrated|best[0-9]{2}",
    block="[0-9]{3}",


include: "workflow/rules/joint_pose_sensitivity.smk"


localrules:
    all,


rule all:
    input:
        [path for study in STUDIES for path in study_results(study)],
    default_target: True


onstart:
    check_engine()
    drop_job_chatter()
    check_writable(STUDIES)


onsuccess:
    say_where(STUDIES)
