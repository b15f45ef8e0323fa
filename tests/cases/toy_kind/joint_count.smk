# Study kind joint_count, made for a test.
rule count_joints:
    output:
        output=f"{results_of('joint_count')}/joints/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/count_joints/specimen={{specimen}}.log",
    params:
        digest=digest("count"),
    run:
        run_job(rule, "count", wildcards, input, output, log)
