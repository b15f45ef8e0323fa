# Study kind range_of_motion: how far spines of known geometry move in tests that nobody did.
# The jobs stand in spinepipe/studies/range_of_motion.

MOTIONS = results_of("range_of_motion")


rule sample_frames:
    input:
        outdated("sample_frames"),
    output:
        output=update(f"{MOTIONS}/frames/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/sample_frames/specimen-{{specimen}}.log",
    params:
        digest=digest("sample_frames"),
    run:
        run_job("sample_frames", rule, wildcards, input, output, params, log)


rule draw_stiffness:
    input:
        outdated("draw_stiffness"),
    output:
        output=update(f"{MOTIONS}/stiffness_sets.parquet"),
    log:
        f"{LOGS}/draw_stiffness.log",
    params:
        digest=digest("draw_stiffness"),
    run:
        run_job("draw_stiffness", rule, wildcards, input, output, params, log)


# Drawn frames with drawn stiffness.
rule moves_block:
    input:
        outdated_block("moves_block", part="move", job="simulate"),
        frames=f"{RESULTS}/frames/specimen-{{specimen}}.parquet",
        stiffness_sets=f"{RESULTS}/stiffness_sets.parquet",
    output:
        output=update(f"{MOTIONS}/blocks/{{table,range_of_motion}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule moves_block as move with:
    output:
        output=update(
            f"{MOTIONS}/jobs/specimen-{{specimen}}/pose-{{pose,[0-9]+}}/stiffness-{{stiffness,[0-9]+}}.parquet"
        ),
    log:
        f"{LOGS}/move/specimen-{{specimen}}/pose-{{pose}}-{{stiffness}}.log",
    params:
        digest=digest("simulate"),
        table="range_of_motion",
