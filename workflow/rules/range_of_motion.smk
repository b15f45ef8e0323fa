# Study kind range_of_motion: how far spines of known geometry move in tests that nobody did.
# Each job is a function `run` of spinepipe.jobs.range_of_motion.
from spinepipe.jobs.range_of_motion.layout import ROM_FIGURES

MOTIONS = results_of("range_of_motion")


rule sample_frames:
    output:
        output=f"{MOTIONS}/frames/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/sample_frames/specimen={{specimen}}.log",
    params:
        digest=digest("range_of_motion.sample_frames"),
    run:
        run_job(rule, "range_of_motion.sample_frames", wildcards, input, output, log)


rule draw_stiffness:
    output:
        output=f"{MOTIONS}/stiffness_sets.parquet",
    log:
        f"{LOGS}/draw_stiffness.log",
    params:
        digest=digest("range_of_motion.draw_stiffness"),
    run:
        run_job(rule, "range_of_motion.draw_stiffness", wildcards, input, output, log)


rule move:
    input:
        frames=f"{RESULTS}/frames/specimen={{specimen}}.parquet",
        stiffness_sets=f"{RESULTS}/stiffness_sets.parquet",
    output:
        output=f"{MOTIONS}/jobs/specimen={{specimen}}/pose={{pose}}/stiffness={{stiffness,[0-9]+}}.parquet",
    log:
        f"{LOGS}/move/specimen={{specimen}}/pose={{pose}}-{{stiffness}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("range_of_motion.simulate"),
    run:
        run_job(rule, "range_of_motion.simulate", wildcards, input, output, log)


for job in ("summary", "variance"):

    rule:
        name:
            f"rom_{job}"
        input:
            range_of_motion=f"{RESULTS}/range_of_motion.parquet",
        output:
            output=f"{MOTIONS}/rom_{job}.parquet",
        log:
            f"{LOGS}/rom_{job}.log",
        params:
            digest=digest(f"range_of_motion.{job}"),
            job=f"range_of_motion.{job}",
        run:
            run_job(rule, params.job, wildcards, input, output, log)


for figure, drawn_from in ROM_FIGURES.items():

    rule:
        name:
            f"figure_{figure}"
        input:
            tables=tables(*drawn_from),
        output:
            svg=shown(MOTIONS, figure),
            png=f"{MOTIONS}/figures/{figure}.png",
        log:
            f"{LOGS}/figure_{figure}.log",
        params:
            digest=digest("range_of_motion.figures"),
            figure=figure,
        run:
            run_job(
                rule,
                "range_of_motion.figures",
                wildcards,
                input,
                output,
                log,
                figure=params.figure,
            )


rule range_of_motion_report:
    input:
        tables=lambda wildcards: layout(wildcards.study).report_tables(),
        figures=lambda wildcards: layout(wildcards.study).figure_files(),
        captions=lambda wildcards: layout(wildcards.study).captions(),
    output:
        output=f"{MOTIONS}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        digest=digest("range_of_motion.report"),
    run:
        run_job(rule, "range_of_motion.report", wildcards, input, output, log)
