# The front door: which studies are computed. What is computed of each: workflow/rules.
import sys

from snakemake.utils import min_version

min_version("9.27")
sys.path.insert(0, workflow.basedir)


include: "workflow/rules/scheduling.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/marks.smk"
include: "workflow/rules/execution.smk"


SELECTION = selection()
warm_up()


wildcard_constraints:
    study="[a-z0-9_]+",
    specimen="[^/=]+",
    pose="[0-9]{4,5}",
    stiffness="calibrated|best[0-9]{2}",
    table="|".join(JOINED),
    bootstrap="start|damping",
    loading="equilibrium|quasi_static|dynamic",
    set="[0-9]{3,4}",
    method="|".join(METHODS),
    sd_mm="[0-9.e+-]+",
    block="[0-9]{3,5}|pooled",
    batch="[0-9]{5,7}",
    representation="[a-z_]+",
    fitted_to="[^/=]+",
    without="[^/=]+",


include: "workflow/rules/aggregation.smk"
include: "workflow/rules/joint_pose_sensitivity.smk"
include: "workflow/rules/identification.smk"
include: "workflow/rules/range_of_motion.smk"
include: "workflow/rules/cohort_stiffness.smk"
include: "workflow/rules/discrepancy.smk"
include: "workflow/rules/global_sensitivity.smk"


rule all:
    default_target: True
    input:
        everything(SELECTION.studies),


# The long studies of config.yaml, read only when asked for.
rule full:
    input:
        lambda wildcards: everything(SELECTION.full),


onstart:
    check_engine()
    check_writable()
    lift_rate_limit()
    look_at_few()
    keep_the_graph()
    logger.addFilter(to_the_point)


onsuccess:
    sweep_logs()
    say_where()


onerror:
    sweep_logs()
