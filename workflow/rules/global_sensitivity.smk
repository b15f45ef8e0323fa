# Study kind global_sensitivity: which uncertain inputs drive motion, joint loads and stiffness.
# The jobs stand in spinepipe/studies/global_sensitivity.

SENSITIVITIES = results_of("global_sensitivity")


wildcard_constraints:
    batch="[0-9]{5,7}",


rule draw_design:
    output:
        output=f"{SENSITIVITIES}/design.parquet",
    log:
        f"{LOGS}/draw_design.log",
    params:
        digest=digest("design"),
    run:
        run_job(rule, "design", wildcards, input, output, log)


# The spine of each specimen before any factor changes it, beside its measured motion.
rule base_of_specimen:
    output:
        base_stiffness=f"{SENSITIVITIES}/base/specimen={{specimen}}/base_stiffness.parquet",
        base_motion=f"{SENSITIVITIES}/base/specimen={{specimen}}/base_motion.parquet",
    log:
        f"{LOGS}/base_of_specimen/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("base"),
    run:
        run_job(rule, "base", wildcards, input, output, log)


# One batch of samples; how many are in one is the study's samples_per_target.
rule respond:
    input:
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=f"{SENSITIVITIES}/jobs/responses/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/respond/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("respond"),
    run:
        run_job(rule, "respond", wildcards, input, output, log, base=[])


rule calibrate_samples:
    input:
        design=f"{RESULTS}/design.parquet",
        base=lambda wildcards: layout(wildcards.study).base_of(wildcards.specimen),
    output:
        output=f"{SENSITIVITIES}/jobs/calibrated/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/calibrate_samples/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("calibrate"),
    run:
        run_job(rule, "calibrate", wildcards, input, output, log, base=[])


rule index_factors:
    input:
        design=f"{RESULTS}/design.parquet",
        responses=lambda wildcards: layout(wildcards.study).blocks_of(
            "responses", wildcards.specimen
        ),
        calibrated=lambda wildcards: layout(wildcards.study).blocks_of(
            "calibrated", wildcards.specimen
        ),
    output:
        indices=f"{SENSITIVITIES}/analysis/specimen={{specimen}}/indices.parquet",
        convergence=f"{SENSITIVITIES}/analysis/specimen={{specimen}}/convergence.parquet",
        failed_runs=f"{SENSITIVITIES}/analysis/specimen={{specimen}}/failed_runs.parquet",
    log:
        f"{LOGS}/index_factors/specimen={{specimen}}.log",
    params:
        digest=digest("analyse"),
    run:
        run_job(
            rule,
            "analyse",
            wildcards,
            input,
            output,
            log,
            responses=[],
            calibrated=[],
        )
