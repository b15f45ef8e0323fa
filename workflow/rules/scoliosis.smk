# Study kind scoliosis: personal stiffness of scoliotic spines from bending films.
# The jobs stand in spinepipe/studies/scoliosis.

PATIENTS = results_of("scoliosis")
HELD = "specimen-{specimen}/model-{model,[a-z_]+}"


rule population:
    input:
        outdated("population"),
    output:
        output=update(f"{PATIENTS}/population.parquet"),
    log:
        f"{LOGS}/population.log",
    priority: 1
    params:
        digest=digest("population"),
    run:
        run_job("population", rule, wildcards, input, output, params, log)


rule personalise:
    input:
        outdated("personalise"),
        population=lambda wildcards: layout(wildcards.study).population_files(wildcards.model),
    output:
        **tables_in(
            f"{PATIENTS}/jobs",
            "laws",
            "positions",
            "displacements",
            "curves",
            "absolute_stiffness",
            of=HELD,
        ),
    log:
        f"{LOGS}/personalise/specimen-{{specimen}}/{{model}}.log",
    params:
        digest=digest("personalise"),
    run:
        run_job("personalise", rule, wildcards, input, output, params, log)


rule variants:
    input:
        outdated("variants"),
    output:
        output=update(f"{PATIENTS}/variants/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/variants/specimen-{{specimen}}.log",
    params:
        digest=digest("variants"),
    run:
        run_job("variants", rule, wildcards, input, output, params, log)
