# Study kind cohort_stiffness: how stiffness differs between specimens, levels and load cases.
# Each job is a function `run` of spinepipe.jobs.cohort_stiffness.
from spinepipe.jobs.cohort_stiffness.layout import COHORT_ANALYSES, COHORT_FIGURES

COHORTS = results_of("cohort_stiffness")
OWN = "specimen={specimen}/representation={representation}/fitted_to={fitted_to}"
POOL = "fitted_to={fitted_to}/without={without}"


rule literature:
    input:
        base_model,
    output:
        stiffness=f"{COHORTS}/literature/specimen={{specimen}}/stiffness.parquet",
        errors=f"{COHORTS}/literature/specimen={{specimen}}/errors.parquet",
        sign_checks=f"{COHORTS}/literature/specimen={{specimen}}/sign_checks.parquet",
    log:
        f"{LOGS}/literature/specimen={{specimen}}.log",
    params:
        digest=digest("cohort_stiffness.literature"),
    run:
        run_job(rule, "cohort_stiffness.literature", wildcards, input, output, log)


rule fit:
    input:
        base_model,
    output:
        stiffness=f"{COHORTS}/fits/{OWN}/stiffness.parquet",
        fits=f"{COHORTS}/fits/{OWN}/fits.parquet",
        errors=f"{COHORTS}/fits/{OWN}/errors.parquet",
    log:
        f"{LOGS}/fits/{OWN}.log",
    params:
        digest=digest("cohort_stiffness.fit"),
    run:
        run_job(rule, "cohort_stiffness.fit", wildcards, input, output, log)


rule left_out:
    input:
        base_model,
        others=fits_of_others,
    output:
        stiffness=f"{COHORTS}/left_out/{OWN}/stiffness.parquet",
        errors=f"{COHORTS}/left_out/{OWN}/errors.parquet",
    log:
        f"{LOGS}/left_out/{OWN}.log",
    params:
        digest=digest("cohort_stiffness.left_out"),
    run:
        run_job(rule, "cohort_stiffness.left_out", wildcards, input, output, log)


rule pool:
    input:
        base_model,
    output:
        stiffness=f"{COHORTS}/pooled/{POOL}/stiffness.parquet",
        fits=f"{COHORTS}/pooled/{POOL}/fits.parquet",
        errors=f"{COHORTS}/pooled/{POOL}/errors.parquet",
        pooling=f"{COHORTS}/pooled/{POOL}/pooling.parquet",
    log:
        f"{LOGS}/pooled/{POOL}.log",
    params:
        digest=digest("cohort_stiffness.pool"),
    run:
        run_job(rule, "cohort_stiffness.pool", wildcards, input, output, log)


# Jobs that make one table of tables: what each reads.
for job, read in COHORT_ANALYSES.items():

    rule:
        name:
            f"cohort_{job}"
        input:
            tables=tables(*read),
        output:
            output=f"{COHORTS}/{job}.parquet",
        log:
            f"{LOGS}/{job}.log",
        params:
            digest=digest(f"cohort_stiffness.{job}"),
            job=f"cohort_stiffness.{job}",
        run:
            run_job(rule, params.job, wildcards, input, output, log)


for figure, drawn_from in COHORT_FIGURES.items():

    rule:
        name:
            f"figure_{figure}"
        input:
            tables=tables(*drawn_from),
        output:
            svg=shown(COHORTS, figure),
            png=f"{COHORTS}/figures/{figure}.png",
        log:
            f"{LOGS}/figure_{figure}.log",
        params:
            digest=digest("cohort_stiffness.figures"),
            figure=figure,
        run:
            run_job(
                rule,
                "cohort_stiffness.figures",
                wildcards,
                input,
                output,
                log,
                figure=params.figure,
            )


rule cohort_report:
    input:
        tables=lambda wildcards: layout(wildcards.study).report_tables(),
        figures=lambda wildcards: layout(wildcards.study).figure_files(),
        captions=lambda wildcards: layout(wildcards.study).captions(),
    output:
        output=f"{COHORTS}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        digest=digest("cohort_stiffness.report"),
    run:
        run_job(rule, "cohort_stiffness.report", wildcards, input, output, log)
