# Study kind global_sensitivity: which uncertain inputs drive motion, joint loads and stiffness.
# The jobs stand in spinepipe/studies/global_sensitivity.

SENSITIVITIES = results_of("global_sensitivity")


wildcard_constraints:
    batch="[0-9]{5,7}",


rule draw_design:
    input:
        outdated("draw_design", "design"),
    output:
        output=update(f"{SENSITIVITIES}/design.parquet"),
    log:
        f"{LOGS}/draw_design.log",
    params:
        digest=digest("design"),
    run:
        run_job("design", rule, wildcards, input, output, params, log)


# The spine of each specimen before any factor changes it, beside its measured motion.
rule base_of_specimen:
    input:
        outdated("base_of_specimen", "base"),
    output:
        **tables_in(
            f"{SENSITIVITIES}/base", "base_stiffness", "base_motion", of="specimen-{specimen}"
        ),
    log:
        f"{LOGS}/base_of_specimen/specimen-{{specimen}}.log",
    params:
        digest=digest("base"),
    run:
        run_job("base", rule, wildcards, input, output, params, log)


# Batches of samples; how many are in one is the study's samples_per_target.
rule responses_block:
    input:
        outdated_block("responses_block", part="respond", job="respond"),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(f"{SENSITIVITIES}/blocks/{{table,responses}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule responses_block as respond with:
    output:
        output=update(
            f"{SENSITIVITIES}/jobs/responses/specimen-{{specimen}}/batch-{{batch}}.parquet"
        ),
    log:
        f"{LOGS}/respond/specimen-{{specimen}}/batch-{{batch}}.log",
    params:
        digest=digest("respond"),
        table="responses",


# Stiffness fitted anew in each sample.
rule calibrated_block:
    input:
        outdated_block("calibrated_block", part="calibrate_samples", job="calibrate"),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(f"{SENSITIVITIES}/blocks/{{table,calibrated}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule calibrated_block as calibrate_samples with:
    output:
        output=update(
            f"{SENSITIVITIES}/jobs/calibrated/specimen-{{specimen}}/batch-{{batch}}.parquet"
        ),
    log:
        f"{LOGS}/calibrate_samples/specimen-{{specimen}}/batch-{{batch}}.log",
    params:
        digest=digest("calibrate"),
        table="calibrated",


rule index_factors:
    input:
        outdated("index_factors", "analyse"),
        design=f"{RESULTS}/design.parquet",
        responses=lambda wildcards: layout(wildcards.study).blocks_of(
            "responses", wildcards.specimen
        ),
        calibrated=lambda wildcards: layout(wildcards.study).blocks_of(
            "calibrated", wildcards.specimen
        ),
    output:
        **tables_in(
            f"{SENSITIVITIES}/analysis",
            "indices",
            "convergence",
            "failed_runs",
            of="specimen-{specimen}",
        ),
    log:
        f"{LOGS}/index_factors/specimen-{{specimen}}.log",
    params:
        digest=digest("analyse"),
    run:
        run_job("analyse", rule, wildcards, input, output, params, log)
