# Study kind range_of_motion: how far spines of known geometry move in tests that nobody did.
# The jobs stand in spinepipe/studies/range_of_motion.

MOTIONS = results_of("range_of_motion")


rule sample_frames:
    output:
        output=f"{MOTIONS}/frames/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/sample_frames/specimen={{specimen}}.log",
    params:
        digest=digest("sample_frames"),
    run:
        run_job(rule, "sample_frames", wildcards, input, output, log)


rule draw_stiffness:
    output:
        output=f"{MOTIONS}/stiffness_sets.parquet",
    log:
        f"{LOGS}/draw_stiffness.log",
    params:
        digest=digest("draw_stiffness"),
    run:
        run_job(rule, "draw_stiffness", wildcards, input, output, log)


rule move:
    input:
        frames=f"{RESULTS}/frames/specimen={{specimen}}.parquet",
        stiffness_sets=f"{RESULTS}/stiffness_sets.parquet",
    output:
        output=f"{MOTIONS}/jobs/specimen={{specimen}}/pose={{pose,[0-9]+}}/stiffness={{stiffness,[0-9]+}}.parquet",
    log:
        f"{LOGS}/move/specimen={{specimen}}/pose={{pose}}-{{stiffness}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("simulate"),
    run:
        run_job(rule, "simulate", wildcards, input, output, log)
