# Study kind discrepancy: which effect a model lacks, where, and how sure that is.
# The job stands in spinepipe/studies/discrepancy.

DISCREPANCIES = f"{results_of('discrepancy')}/discrepancy"


# One job: each step of the search depends on what the last one found.
rule discrepancy_search:
    input:
        outdated("discrepancy_search", "search"),
        base_model,
    output:
        verdict=update(f"{DISCREPANCIES}/verdict.json"),
        gap=update(f"{DISCREPANCIES}/gap.parquet"),
        candidates=update(f"{DISCREPANCIES}/candidates.parquet"),
        where=update(f"{DISCREPANCIES}/where.parquet"),
        confusions=update(f"{DISCREPANCIES}/confusions.parquet"),
        held_out=update(f"{DISCREPANCIES}/held_out.parquet"),
        imperfections=update(f"{DISCREPANCIES}/imperfections.parquet"),
        next_tests=update(f"{DISCREPANCIES}/next_tests.parquet"),
        field_numbers=update(f"{DISCREPANCIES}/field_numbers.parquet"),
        tabulated=update(f"{DISCREPANCIES}/tabulated.parquet"),
        design=update(f"{DISCREPANCIES}/design.csv"),
        model_base=update(f"{DISCREPANCIES}/model_base.yaml"),
        model_with_effects=update(f"{DISCREPANCIES}/model_with_effects.yaml"),
    log:
        f"{LOGS}/discrepancy_search.log",
    priority: 1
    params:
        digest=digest("search"),
    run:
        run_job("search", rule, wildcards, input, output, params, log)
