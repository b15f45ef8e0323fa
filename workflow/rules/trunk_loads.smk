# Study kind trunk_loads: muscle forces, joint loads and disc pressure of persons in tasks.
# The jobs stand in spinepipe/studies/trunk_loads.

TRUNKS = results_of("trunk_loads")


rule hold:
    input:
        outdated("hold"),
    output:
        **tables_in(
            f"{TRUNKS}/jobs",
            "tasks",
            "levels",
            "muscles",
            "paths",
            "iterations",
            "upright",
            "masses",
            "scaling",
            "remarks",
            of="specimen-{specimen}",
        ),
    log:
        f"{LOGS}/hold/specimen-{{specimen}}.log",
    params:
        digest=digest("hold"),
    run:
        run_job("hold", rule, wildcards, input, output, params, log)


# The frames of one recorded lift of one person.
rule lift:
    input:
        outdated("lift"),
    output:
        **tables_in(
            f"{TRUNKS}/jobs",
            "lift_loads",
            "lift_frames",
            "lift_bands",
            "lift_paths",
            of="specimen-{specimen}/trial-{trial}",
        ),
    log:
        f"{LOGS}/lift/specimen-{{specimen}}/{{trial}}.log",
    params:
        digest=digest("lift"),
    run:
        run_job("lift", rule, wildcards, input, output, params, log)


rule simplify:
    input:
        outdated("simplify"),
    output:
        output=update(f"{TRUNKS}/jobs/simplified/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/simplify/specimen-{{specimen}}.log",
    params:
        digest=digest("simplify"),
    run:
        run_job("simplify", rule, wildcards, input, output, params, log)


rule tune:
    input:
        outdated("tune"),
    output:
        **tables_in(TRUNKS, "pressures", "tuning", "agreement"),
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
        outdated_block("samples_block", part="sample_loads", job="respond"),
        design=f"{RESULTS}/design.parquet",
    output:
        output=update(f"{TRUNKS}/blocks/{{table,responses}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule samples_block as sample_loads with:
    output:
        output=update(f"{TRUNKS}/jobs/responses/specimen-{{specimen}}/batch-{{batch}}.parquet"),
    log:
        f"{LOGS}/sample_loads/specimen-{{specimen}}/batch-{{batch}}.log",
    params:
        digest=digest("respond"),
        table="responses",
