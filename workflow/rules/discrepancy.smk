# Study kind discrepancy: which effect a model lacks, where, and how sure that is.
# Each job is a function `run` of spinepipe.jobs.discrepancy.
from spinepipe.jobs.discrepancy.layout import DISCREPANCY_FIGURES

DISCREPANCIES = f"{results_of('discrepancy')}/discrepancy"
VERDICT = f"{RESULTS}/discrepancy/verdict.json"


# One job: each step of the search depends on what the last one found.
rule discrepancy_search:
    input:
        lambda wildcards: layout(wildcards.study).base_model(),
    output:
        verdict=f"{DISCREPANCIES}/verdict.json",
        gap=f"{DISCREPANCIES}/gap.parquet",
        candidates=f"{DISCREPANCIES}/candidates.parquet",
        where=f"{DISCREPANCIES}/where.parquet",
        confusions=f"{DISCREPANCIES}/confusions.parquet",
        held_out=f"{DISCREPANCIES}/held_out.parquet",
        model_base=f"{DISCREPANCIES}/model_base.yaml",
        model_with_effects=f"{DISCREPANCIES}/model_with_effects.yaml",
    log:
        f"{LOGS}/discrepancy_search.log",
    params:
        digest=digest("discrepancy.search"),
    run:
        run_job(rule, "discrepancy.search", wildcards, input, output, log)


for figure, drawn_from in DISCREPANCY_FIGURES.items():

    rule:
        name:
            f"figure_{figure}"
        input:
            tables=tables(*drawn_from),
            verdict=VERDICT,
        output:
            svg=shown(DISCREPANCIES, figure),
            png=f"{DISCREPANCIES}/figures/{figure}.png",
        log:
            f"{LOGS}/figure_{figure}.log",
        params:
            digest=digest("discrepancy.figures"),
            figure=figure,
        run:
            run_job(
                rule,
                "discrepancy.figures",
                wildcards,
                input,
                output,
                log,
                figure=params.figure,
            )


rule discrepancy_report:
    input:
        tables=lambda wildcards: layout(wildcards.study).report_tables(),
        figures=lambda wildcards: layout(wildcards.study).figure_files(),
        captions=lambda wildcards: layout(wildcards.study).captions(),
        verdict=VERDICT,
    output:
        output=f"{DISCREPANCIES}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        digest=digest("discrepancy.report"),
    run:
        run_job(rule, "discrepancy.report", wildcards, input, output, log)
