# The front door: which studies are computed. What is computed of each: workflow/rules.
import sys
from pathlib import Path

from snakemake.utils import min_version

min_version("9.27")
if Path(workflow.basedir, "spinepipe", "__init__.py").is_file():  # in a clone its own copy counts
    sys.path.insert(0, workflow.basedir)


include: "workflow/rules/common.smk"


wildcard_constraints:
    study="[a-z0-9_]+",
    specimen="[^/=]+",
    block="[0-9]{3,5}|[a-z]+",


include: "workflow/rules/generic.smk"


for kind in PROJECT.kinds:

    include: f"workflow/rules/{kind}.smk"


rule all:
    default_target: True
    input:
        PROJECT.everything(PROJECT.selection.studies),


# The long studies of config.yaml, read only when asked for, and what takes long of the others.
rule full:
    input:
        lambda wildcards: PROJECT.everything(
            PROJECT.selection.studies + PROJECT.selection.full, full=True
        ),


onstart:
    PROJECT.begin()


onsuccess:
    PROJECT.end()


onerror:
    PROJECT.end()
