# Study kind discrepancy: which effect a model lacks, where, and how sure that is.
# The job stands in spinepipe/studies/discrepancy.

DISCREPANCIES = f"{results_of('discrepancy')}/discrepancy"


# One job: each step of the search depends on what the last one found.
rule discrepancy_search:
    input:
        outdated("discrepancy_search", "search"),
        PROJECT.base_model,
    output:
        **tables_in(
            DISCREPANCIES,
            "gap",
            "candidates",
            "where",
            "confusions",
            "held_out",
            "imperfections",
            "next_tests",
            "field_numbers",
            "tabulated",
        ),
        verdict=update(f"{DISCREPANCIES}/verdict.json"),
        design=update(f"{DISCREPANCIES}/design.csv"),
        model_base=update(f"{DISCREPANCIES}/model_base.yaml"),
        model_with_effects=update(f"{DISCREPANCIES}/model_with_effects.yaml"),
    log:
        f"{LOGS}/discrepancy_search.log",
    priority: 1
    # Half of the cores: most searches have long pieces that wait for one another.
    threads: max(1, min(4, (workflow.cores or 1) // 2))
    params:
        digest=digest("search"),
        threads=lambda wildcards, threads: threads,
    run:
        run_job("search", rule, wildcards, input, output, params, log)
