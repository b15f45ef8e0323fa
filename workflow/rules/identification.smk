# What a joint-pose study tells beyond its poses: bootstraps, methods, precision, tests, report.
from spinepipe.jobs.layout import COMPARED, FIGURES


rule bootstrap:
    output:
        output=f"{POSES}/bootstrap/specimen={{specimen}}/bootstrap={{bootstrap}}/loading={{loading}}/set={{set}}.parquet",
    log:
        f"{LOGS}/bootstrap/specimen={{specimen}}/{{bootstrap}}-{{loading}}-{{set}}.log",
    params:
        digest=digest("bootstrap"),
    run:
        run_job(rule, "bootstrap", wildcards, input, output, log)


rule fit_by_method:
    input:
        poses=f"{RESULTS}/poses/specimen={{specimen}}.parquet",
    output:
        output=f"{POSES}/methods/specimen={{specimen}}/pose={{pose}}/method={{method}}.parquet",
    log:
        f"{LOGS}/methods/specimen={{specimen}}/pose={{pose}}-{{method}}.log",
    params:
        digest=digest("fit_by_method"),
    run:
        run_job(rule, "fit_by_method", wildcards, input, output, log)


rule landmark_errors:
    output:
        output=f"{POSES}/precision/specimen={{specimen}}/sd_mm={{sd_mm}}.parquet",
    log:
        f"{LOGS}/precision/specimen={{specimen}}/sd_mm={{sd_mm}}.log",
    params:
        digest=digest("landmark_errors"),
    run:
        run_job(rule, "landmark_errors", wildcards, input, output, log)


# Jobs that make one or two tables of tables: (job, tables read, tables written, best.json too).
FITTED = ("calibrations", "simulations", "poses", "success")
ANALYSES = (
    ("success", {"calibrations": "calibrations"}, {"output": "success"}, False),
    ("counts", ("success", "bootstrap"), {"output": "counts"}, False),
    ("summary", (*FITTED, "bootstrap"), {"output": "summary"}, True),
    ("statistics", FITTED, {"output": "statistics"}, True),
    ("agreement", ("simulations", "success"), {"output": "agreement"}, False),
    (
        "two_factor",
        ("simulations", "poses", "success"),
        {"shares": "variance_shares", "importance": "importance"},
        True,
    ),
    (
        "success_by_method",
        {"fits": "method_fits"},
        {"output": "success_by_method"},
        False,
    ),
    (
        "landmark_precision",
        {"errors": "precision_errors"},
        {"precision": "landmark_precision", "required": "required_precision"},
        False,
    ),
    ("against_gould_2024a", COMPARED, {"output": "against_gould_2024a"}, False),
)

for job, read, written, ranked in ANALYSES:

    rule:
        name:
            job
        input:
            **(
                {name: f"{RESULTS}/{table}.parquet" for name, table in read.items()}
                if isinstance(read, dict)
                else {"tables": tables(*read)}
            ),
            **({"best": f"{RESULTS}/best.json"} if ranked else {}),
        output:
            **{name: f"{POSES}/{table}.parquet" for name, table in written.items()},
        log:
            f"{LOGS}/{job}.log",
        params:
            digest=digest(job),
            job=job,
        run:
            run_job(rule, params.job, wildcards, input, output, log)


for figure, drawn_from in FIGURES.items():

    rule:
        name:
            f"figure_{figure}"
        input:
            tables=tables(*drawn_from),
        output:
            svg=shown(POSES, figure),
            png=f"{POSES}/figures/{figure}.png",
        log:
            f"{LOGS}/figure_{figure}.log",
        params:
            digest=digest("figures"),
            figure=figure,
        run:
            run_job(
                rule, "figures", wildcards, input, output, log, figure=params.figure
            )


rule study_report:
    input:
        tables=lambda wildcards: layout(wildcards.study).report_tables(),
        figures=lambda wildcards: layout(wildcards.study).figure_files(),
        captions=lambda wildcards: layout(wildcards.study).captions(),
    output:
        output=f"{POSES}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        digest=digest("report"),
    run:
        run_job(rule, "report", wildcards, input, output, log)
