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


# One batch of samples; how many are in one is the study's samples_per_target.
rule respond:
    input:
        design=f"{RESULTS}/design.parquet",
    output:
        output=f"{SENSITIVITIES}/jobs/responses/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/respond/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("respond"),
    run:
        run_job(rule, "respond", wildcards, input, output, log)


rule calibrate_samples:
    input:
        design=f"{RESULTS}/design.parquet",
    output:
        output=f"{SENSITIVITIES}/jobs/calibrated/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/calibrate_samples/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("calibrate"),
    run:
        run_job(rule, "calibrate", wildcards, input, output, log)


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
