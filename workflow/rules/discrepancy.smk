# Study kind discrepancy: which effect a model lacks, where, and how sure that is.
# The job stands in spinepipe/studies/discrepancy.

DISCREPANCIES = f"{results_of('discrepancy')}/discrepancy"


# One job: each step of the search depends on what the last one found.
rule discrepancy_search:
    input:
        base_model,
    output:
        verdict=f"{DISCREPANCIES}/verdict.json",
        gap=f"{DISCREPANCIES}/gap.parquet",
        candidates=f"{DISCREPANCIES}/candidates.parquet",
        where=f"{DISCREPANCIES}/where.parquet",
        confusions=f"{DISCREPANCIES}/confusions.parquet",
        held_out=f"{DISCREPANCIES}/held_out.parquet",
        imperfections=f"{DISCREPANCIES}/imperfections.parquet",
        next_tests=f"{DISCREPANCIES}/next_tests.parquet",
        field_numbers=f"{DISCREPANCIES}/field_numbers.parquet",
        tabulated=f"{DISCREPANCIES}/tabulated.parquet",
        design=f"{DISCREPANCIES}/design.csv",
        model_base=f"{DISCREPANCIES}/model_base.yaml",
        model_with_effects=f"{DISCREPANCIES}/model_with_effects.yaml",
    log:
        f"{LOGS}/discrepancy_search.log",
    priority: 1
    threads: 4
    params:
        digest=digest("search"),
    run:
        run_job(rule, "search", wildcards, input, output, log, threads=threads)
