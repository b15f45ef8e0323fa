# Study kind trunk_loads: muscle forces, joint loads and disc pressure of persons in tasks.
# The jobs stand in spinepipe/studies/trunk_loads.

TRUNKS = results_of("trunk_loads")


rule hold:
    input:
        outdated("hold"),
    output:
        tasks=update(f"{TRUNKS}/jobs/specimen={{specimen}}/tasks.parquet"),
        levels=update(f"{TRUNKS}/jobs/specimen={{specimen}}/levels.parquet"),
        muscles=update(f"{TRUNKS}/jobs/specimen={{specimen}}/muscles.parquet"),
        paths=update(f"{TRUNKS}/jobs/specimen={{specimen}}/paths.parquet"),
        iterations=update(f"{TRUNKS}/jobs/specimen={{specimen}}/iterations.parquet"),
        upright=update(f"{TRUNKS}/jobs/specimen={{specimen}}/upright.parquet"),
        masses=update(f"{TRUNKS}/jobs/specimen={{specimen}}/masses.parquet"),
        scaling=update(f"{TRUNKS}/jobs/specimen={{specimen}}/scaling.parquet"),
        remarks=update(f"{TRUNKS}/jobs/specimen={{specimen}}/remarks.parquet"),
    log:
        f"{LOGS}/hold/specimen={{specimen}}.log",
    params:
        digest=digest("hold"),
    run:
        run_job("hold", rule, wildcards, input, output, params, log)


rule simplify:
    input:
        outdated("simplify"),
    output:
        output=update(f"{TRUNKS}/jobs/specimen={{specimen}}/simplified.parquet"),
    log:
        f"{LOGS}/simplify/specimen={{specimen}}.log",
    params:
        digest=digest("simplify"),
    run:
        run_job("simplify", rule, wildcards, input, output, params, log)


rule tune:
    input:
        outdated("tune"),
    output:
        pressures=update(f"{TRUNKS}/pressures.parquet"),
        tuning=update(f"{TRUNKS}/tuning.parquet"),
        agreement=update(f"{TRUNKS}/agreement.parquet"),
    log:
        f"{LOGS}/tune.log",
    priority: 1
    params:
        digest=digest("tune"),
    run:
        run_job("tune", rule, wildcards, input, output, params, log)


rule draw_inputs:
    input:
        outdated("draw_inputs", "draw"),
    output:
        output=update(f"{TRUNKS}/design.parquet"),
    log:
        f"{LOGS}/draw_inputs.log",
    params:
        digest=digest("draw"),
    run:
        run_job("draw", rule, wildcards, input, output, params, log)


# Batches of samples of a person; how many are in one is the study's samples_per_target.
rule samples_block:
    input:
        outdated("samples_block", block_digest("responses")),
        design=f"{RESULTS}/design.parquet",
    output:
        output=update(
            f"{TRUNKS}/blocks/{{table,responses}}/specimen={{specimen}}/block={{block}}.parquet"
        ),
    log:
        f"{LOGS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.log",
    params:
        digest=block_digest("responses"),
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
rule sample_loads:
    input:
        outdated("sample_loads", "respond"),
        design=f"{RESULTS}/design.parquet",
    output:
        output=update(f"{TRUNKS}/jobs/specimen={{specimen}}/batch={{batch}}/responses.parquet"),
    log:
        f"{LOGS}/sample_loads/specimen={{specimen}}/batch={{batch}}.log",
    params:
        digest=digest("respond"),
        table="responses",
    run:
        run_job(PART, rule, wildcards, input, output, params, log)
