# Study kind trunk_loads: muscle forces, joint loads and disc pressure of persons in tasks.
# The jobs stand in spinepipe/studies/trunk_loads.

TRUNKS = results_of("trunk_loads")


rule hold:
    output:
        tasks=f"{TRUNKS}/jobs/specimen={{specimen}}/tasks.parquet",
        levels=f"{TRUNKS}/jobs/specimen={{specimen}}/levels.parquet",
        muscles=f"{TRUNKS}/jobs/specimen={{specimen}}/muscles.parquet",
        paths=f"{TRUNKS}/jobs/specimen={{specimen}}/paths.parquet",
        iterations=f"{TRUNKS}/jobs/specimen={{specimen}}/iterations.parquet",
        upright=f"{TRUNKS}/jobs/specimen={{specimen}}/upright.parquet",
        masses=f"{TRUNKS}/jobs/specimen={{specimen}}/masses.parquet",
        scaling=f"{TRUNKS}/jobs/specimen={{specimen}}/scaling.parquet",
        remarks=f"{TRUNKS}/jobs/specimen={{specimen}}/remarks.parquet",
    log:
        f"{LOGS}/hold/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("hold"),
    run:
        run_job(rule, "hold", wildcards, input, output, log)


rule simplify:
    output:
        output=f"{TRUNKS}/jobs/specimen={{specimen}}/simplified.parquet",
    log:
        f"{LOGS}/simplify/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("simplify"),
    run:
        run_job(rule, "simplify", wildcards, input, output, log)


rule tune:
    output:
        pressures=f"{TRUNKS}/pressures.parquet",
        tuning=f"{TRUNKS}/tuning.parquet",
        agreement=f"{TRUNKS}/agreement.parquet",
    log:
        f"{LOGS}/tune.log",
    priority: 1
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("tune"),
    run:
        run_job(rule, "tune", wildcards, input, output, log)


rule draw_inputs:
    output:
        output=f"{TRUNKS}/design.parquet",
    log:
        f"{LOGS}/draw_inputs.log",
    params:
        digest=digest("draw"),
    run:
        run_job(rule, "draw", wildcards, input, output, log)


# One batch of samples of one person; how many are in one is the study's samples_per_target.
rule sample_loads:
    input:
        design=f"{RESULTS}/design.parquet",
    output:
        output=f"{TRUNKS}/jobs/specimen={{specimen}}/batch={{batch}}/responses.parquet",
    log:
        f"{LOGS}/sample_loads/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("respond"),
    run:
        run_job(rule, "respond", wildcards, input, output, log)
