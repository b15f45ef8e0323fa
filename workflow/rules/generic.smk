# What every kind of study has: tables joined from job files, tables made of tables, figures, report.
# Which they are stands in the declaration of the kind, spinepipe/studies/<kind>/kind.py.


# One set of rules for each kind of study that has a study file: their patterns name the studies, so
# that a file is tried against the rules of its own kind alone.
for kind in KINDS_IN_USE:
    place = results_of(kind)
    made = kind_of(kind)

    if made.files.joined:

        rule:
            name:
                f"{kind}_block"
            input:
                jobs_of_block,
            output:
                f"{place}/blocks/{{table,{one_of(made.files.joined)}}}/specimen={{specimen}}/block={{block}}.parquet",
            log:
                f"{LOGS}/blocks/{{table}}/specimen={{specimen}}/block={{block}}.log",
            wildcard_constraints:
                block="[0-9]{3,5}|[a-z]+",
            params:
                digest=block_digest,
            run:
                collect(rule, wildcards, input, output, log)

        rule:
            name:
                f"{kind}_table"
            input:
                blocks_of_table,
            output:
                f"{place}/{{table,{one_of(made.files.joined)}}}.parquet",
            log:
                f"{LOGS}/{{table}}.log",
            params:
                digest=table_digest,
            run:
                collect(rule, wildcards, input, output, log)

    # Tables computed from tables: a rule for each job, as a job may make several.
    for job in made.analyses:

        rule:
            name:
                f"{kind}_{job.name}"
            input:
                **inputs_of(made, job),
            output:
                **outputs_of(place, made, job),
            log:
                f"{LOGS}/{job.name}.log",
            params:
                digest=digest(job.name),
                job=job.name,
            run:
                run_job(rule, params.job, wildcards, input, output, log)

    if made.figures:

        rule:
            name:
                f"{kind}_figure"
            input:
                unpack(inputs_of_figure),
            output:
                svg=report(
                    f"{place}/{made.files.subfolder}figures/{{figure,{one_of(f.name for f in made.figures)}}}.svg",
                    caption="../report/figure.rst",
                    category="{study}",
                ),
                png=f"{place}/{made.files.subfolder}figures/{{figure,{one_of(f.name for f in made.figures)}}}.png",
            log:
                f"{LOGS}/figure_{{figure}}.log",
            params:
                digest=figure_digest,
                caption=caption_of_figure,
            run:
                run_core(rule, "draw", wildcards, input, output, log)

    rule:
        name:
            f"{kind}_report"
        input:
            unpack(inputs_of_page),
        output:
            output=f"{place}/{made.files.subfolder}{{page,report|full}}.html",
        log:
            f"{LOGS}/{{page}}.log",
        params:
            digest=report_digest,
        run:
            run_core(rule, "report", wildcards, input, output, log)
