# Study kind global_sensitivity: which uncertain inputs drive motion, joint loads and stiffness.
# Each job is a function `run` of spinepipe.jobs.global_sensitivity.
from spinepipe.jobs.global_sensitivity.layout import SENSITIVITY_FIGURES

SENSITIVITIES = results_of("global_sensitivity")


rule draw_design:
    output:
        output=f"{SENSITIVITIES}/design.parquet",
    log:
        f"{LOGS}/draw_design.log",
    params:
        digest=digest("global_sensitivity.design"),
    run:
        run_job(rule, "global_sensitivity.design", wildcards, input, output, log)


# One batch of samples; how many are in one is the study's samples_per_target.
rule respond:
    input:
        design=f"{RESULTS}/design.parquet",
    output:
        output=f"{SENSITIVITIES}/jobs/responses/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/respond/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("global_sensitivity.respond"),
    run:
        run_job(rule, "global_sensitivity.respond", wildcards, input, output, log)


rule calibrate_samples:
    input:
        design=f"{RESULTS}/design.parquet",
    output:
        output=f"{SENSITIVITIES}/jobs/calibrated/specimen={{specimen}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/calibrate_samples/specimen={{specimen}}/batch={{batch}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("global_sensitivity.calibrate"),
    run:
        run_job(rule, "global_sensitivity.calibrate", wildcards, input, output, log)


rule index_factors:
    input:
        design=f"{RESULTS}/design.parquet",
        responses=blocks_of_specimen("responses"),
        calibrated=blocks_of_specimen("calibrated"),
    output:
        indices=f"{SENSITIVITIES}/analysis/specimen={{specimen}}/indices.parquet",
        convergence=f"{SENSITIVITIES}/analysis/specimen={{specimen}}/convergence.parquet",
    log:
        f"{LOGS}/index_factors/specimen={{specimen}}.log",
    params:
        digest=digest("global_sensitivity.analyse"),
    run:
        run_job(
            rule,
            "global_sensitivity.analyse",
            wildcards,
            input,
            output,
            log,
            responses=[],
            calibrated=[],
        )


for figure, drawn_from in SENSITIVITY_FIGURES.items():

    rule:
        name:
            f"figure_{figure}"
        input:
            tables=tables(*drawn_from),
        output:
            svg=shown(SENSITIVITIES, figure),
            png=f"{SENSITIVITIES}/figures/{figure}.png",
        log:
            f"{LOGS}/figure_{figure}.log",
        params:
            digest=digest("global_sensitivity.figures"),
            figure=figure,
        run:
            run_job(
                rule,
                "global_sensitivity.figures",
                wildcards,
                input,
                output,
                log,
                figure=params.figure,
            )


rule global_sensitivity_report:
    input:
        tables=lambda wildcards: layout(wildcards.study).report_tables(),
        figures=lambda wildcards: layout(wildcards.study).figure_files(),
        captions=lambda wildcards: layout(wildcards.study).captions(),
    output:
        output=f"{SENSITIVITIES}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        digest=digest("global_sensitivity.report"),
    run:
        run_job(rule, "global_sensitivity.report", wildcards, input, output, log)
