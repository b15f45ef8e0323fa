# Study kind scoliosis: personal stiffness of scoliotic spines from bending films.
# The jobs stand in spinepipe/studies/scoliosis.

PATIENTS = results_of("scoliosis")
HELD = "specimen={specimen}/model={model,[a-z_]+}"


rule population:
    output:
        output=f"{PATIENTS}/population.parquet",
    log:
        f"{LOGS}/population.log",
    priority: 1
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("population"),
    run:
        run_job(rule, "population", wildcards, input, output, log)


rule personalise:
    input:
        population=lambda wildcards: layout(wildcards.study).population_files(
            wildcards.model
        ),
    output:
        laws=f"{PATIENTS}/jobs/{HELD}/laws.parquet",
        positions=f"{PATIENTS}/jobs/{HELD}/positions.parquet",
        displacements=f"{PATIENTS}/jobs/{HELD}/displacements.parquet",
        curves=f"{PATIENTS}/jobs/{HELD}/curves.parquet",
    log:
        f"{LOGS}/personalise/specimen={{specimen}}/{{model}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("personalise"),
    run:
        run_job(rule, "personalise", wildcards, input, output, log)


rule variants:
    output:
        output=f"{PATIENTS}/variants/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/variants/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("variants"),
    run:
        run_job(rule, "variants", wildcards, input, output, log)
