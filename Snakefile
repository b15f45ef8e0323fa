# The front door: which studies are computed. What is computed of each: workflow/rules.
import sys

from snakemake.utils import min_version

min_version("9.27")
sys.path.insert(0, workflow.basedir)


include: "workflow/rules/scheduling.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/disk.smk"
include: "workflow/rules/lock.smk"
include: "workflow/rules/marks.smk"
include: "workflow/rules/execution.smk"


SELECTION = selection()
# A submitted job has work to do, and Snakemake leaves out onstart.
if not workflow.is_main_process:
    warm_up(modules_of_many(KINDS_IN_USE))


wildcard_constraints:
    study="[a-z0-9_]+",
    specimen="[^/=]+",


include: "workflow/rules/generic.smk"


for kind in KINDS_IN_USE:

    include: f"workflow/rules/{kind}.smk"


rule all:
    default_target: True
    input:
        everything(SELECTION.studies),


# The long studies of config.yaml, read only when asked for, and what takes long of the others.
rule full:
    input:
        lambda wildcards: everything(SELECTION.studies + SELECTION.full, full=True),


onstart:
    check_environment()
    check_engine()
    check_writable()
    warm_up_the_pool()
    tell_remade()
    tell_how_many_lost()
    tell_doubts()
    lift_rate_limit()
    look_at_few()
    keep_the_graph()


onsuccess:
    tell_how_many_lost()
    sweep_logs()


onerror:
    tell_how_many_lost()
    sweep_logs()
