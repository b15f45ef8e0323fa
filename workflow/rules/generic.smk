# What every kind of study has: tables joined from job files, tables made of tables, figures, report.
# Which they are stands in the declaration of the kind, spinepipe/studies/<kind>/kind.py.


def inputs_of(kind, job):
    """Input of a job that reads tables: of those that the study at hand has, and other files."""
    full = set(job.writes) <= set(kind.files.full)
    tables = lambda wildcards: layout(wildcards.study).table_files(job.reads, full)
    folder = f"{RESULTS}/{kind.files.subfolder}"
    others = [name for name in job.reads if "." in name]
    return {
        "tables": tables,
        **{name.split(".")[0]: f"{folder}{name}" for name in others},
    }


def outputs_of(place, kind, job):
    """Output of a job that makes tables: one is called `output`, several by their names."""
    folder = f"{place}/{kind.files.subfolder}"
    files = {name: update(f"{folder}{name}.parquet") for name in job.writes}
    return files if len(files) > 1 else {"output": files[job.writes[0]]}


def pages_of(place, kind):
    """Output of the job of a page: it, and where a kind once had it a page that leads there."""
    once = kind.files.subfolder
    former = {"former": update(f"{place}/{once}{{page,report|full}}.html")} if once else {}
    return {"output": update(f"{place}/{{page,report|full}}.html"), **former}


# One set of rules for each kind of study that has a study file: their patterns name the studies, so
# that a file is tried against the rules of its own kind alone.
for kind in PROJECT.kinds:
    place = results_of(kind)
    made = kind_of(kind)
    drawn = (
        f"{place}/{made.files.subfolder}figures/{{figure,{one_of(f.name for f in made.figures)}}}"
    )

    if made.joined:

        rule:
            name:
                f"{kind}_block"
            input:
                outdated(f"{kind}_block", PROJECT.mark_of_block),
                inputs=lambda wildcards: layout(wildcards.study).job_files(
                    wildcards.table, wildcards.specimen, wildcards.block
                ),
            output:
                output=update(f"{place}/blocks/{{table,{one_of(made.joined)}}}/{OF_BLOCK}.parquet"),
            log:
                f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
            params:
                digest=PROJECT.mark_of_block,
            run:
                run_job(JOIN, rule, wildcards, input, output, params, log)

    if made.files.joined:

        rule:
            name:
                f"{kind}_table"
            input:
                outdated(f"{kind}_table", PROJECT.mark_of_table),
                inputs=lambda wildcards: layout(wildcards.study).block_files(wildcards.table),
            output:
                output=update(f"{place}/{{table,{one_of(made.files.joined)}}}.parquet"),
            log:
                f"{LOGS}/{{table}}.log",
            params:
                digest=PROJECT.mark_of_table,
            run:
                run_job(JOIN, rule, wildcards, input, output, params, log)

    # Tables computed from tables: a rule for each job, as a job may make several.
    for job in made.analyses:

        rule:
            name:
                f"{kind}_{job.name}"
            input:
                outdated(f"{kind}_{job.name}", job.name),
                **inputs_of(made, job),
            output:
                **outputs_of(place, made, job),
            log:
                f"{LOGS}/{job.name}.log",
            params:
                digest=digest(job.name),
                job=job.name,
            run:
                run_job(params.job, rule, wildcards, input, output, params, log)

    if made.figures:

        rule:
            name:
                f"{kind}_figure"
            input:
                outdated(f"{kind}_figure", PROJECT.mark_of_figure),
                unpack(PROJECT.inputs_of_figure),
            output:
                svg=report(
                    update(f"{drawn}.svg"),
                    caption="../report/figure.rst",
                    category="{study}",
                ),
                pdf=update(f"{drawn}.pdf"),
                png=update(f"{drawn}.png"),
            log:
                f"{LOGS}/figure_{{figure}}.log",
            params:
                digest=PROJECT.mark_of_figure,
            run:
                run_job(DRAW, rule, wildcards, input, output, params, log)

    rule:
        name:
            f"{kind}_report"
        input:
            outdated(f"{kind}_report", PROJECT.mark_of_page),
            unpack(PROJECT.inputs_of_page),
        output:
            **pages_of(place, made),
        log:
            f"{LOGS}/{{page}}.log",
        params:
            digest=PROJECT.mark_of_page,
        run:
            run_job(REPORT, rule, wildcards, input, output, params, log)
