# Many job files become one table, block by block, in studies of every kind.


rule aggregate_block:
    input:
        jobs_of_block,
    output:
        f"{RESULTS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.parquet",
    log:
        f"{LOGS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.log",
    params:
        digest=block_digest,
    run:
        collect(rule, wildcards, input, output, log)


rule aggregate_table:
    input:
        blocks_of_table,
    output:
        f"{RESULTS}/{{table}}.parquet",
    log:
        f"{LOGS}/{{table}}.log",
    params:
        digest=table_digest,
    run:
        collect(rule, wildcards, input, output, log)
