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
        base_stiffness=update(f"{SENSITIVITIES}/base/specimen={{specimen}}/base_stiffness.parquet"),
        base_motion=update(f"{SENSITIVITIES}/base/specimen={{specimen}}/base_motion.parquet"),
    log:
        f"{LOGS}/base_of_specimen/specimen={{specimen}}.log",
    params:
        digest=digest("base"),
    run:
        run_job("base", rule, wildcards, input, output, params, log)


# Batches of samples; how many are in one is the study's samples_per_target.
rule responses_block:
    input:
        outdated("responses_block", block_digest("responses")),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(
            f"{SENSITIVITIES}/blocks/{{table,responses}}/specimen={{specimen}}/block={{block}}.parquet"
        ),
    log:
        f"{LOGS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.log",
    params:
        digest=block_digest("responses"),
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
rule respond:
    input:
        outdated("respond"),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(
            f"{SENSITIVITIES}/jobs/responses/specimen={{specimen}}/batch={{batch}}.parquet"
        ),
    log:
        f"{LOGS}/respond/specimen={{specimen}}/batch={{batch}}.log",
    params:
        digest=digest("respond"),
        table="responses",
    run:
        run_job(PART, rule, wildcards, input, output, params, log)


# Stiffness fitted anew in each sample.
rule calibrated_block:
    input:
        outdated("calibrated_block", block_digest("calibrated")),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(
            f"{SENSITIVITIES}/blocks/{{table,calibrated}}/specimen={{specimen}}/block={{block}}.parquet"
        ),
    log:
        f"{LOGS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.log",
    params:
        digest=block_digest("calibrated"),
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
rule calibrate_samples:
    input:
        outdated("calibrate_samples", "calibrate"),
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=update(
            f"{SENSITIVITIES}/jobs/calibrated/specimen={{specimen}}/batch={{batch}}.parquet"
        ),
    log:
        f"{LOGS}/calibrate_samples/specimen={{specimen}}/batch={{batch}}.log",
    params:
        digest=digest("calibrate"),
        table="calibrated",
    run:
        run_job(PART, rule, wildcards, input, output, params, log)


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
        indices=update(f"{SENSITIVITIES}/analysis/specimen={{specimen}}/indices.parquet"),
        convergence=update(f"{SENSITIVITIES}/analysis/specimen={{specimen}}/convergence.parquet"),
        failed_runs=update(f"{SENSITIVITIES}/analysis/specimen={{specimen}}/failed_runs.parquet"),
    log:
        f"{LOGS}/index_factors/specimen={{specimen}}.log",
    params:
        digest=digest("analyse"),
    run:
        run_job("analyse", rule, wildcards, input, output, params, log)
