# Study kind joint_count, made for a test.
rule count_joints:
    input:
        outdated("count_joints", "count"),
    output:
        output=update(f"{results_of('joint_count')}/joints/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/count_joints/specimen-{{specimen}}.log",
    params:
        digest=digest("count"),
    run:
        run_job("count", rule, wildcards, input, output, params, log)
