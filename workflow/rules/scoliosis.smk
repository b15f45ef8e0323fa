# Study kind scoliosis: personal stiffness of scoliotic spines from bending films.
# The jobs stand in spinepipe/studies/scoliosis.

PATIENTS = results_of("scoliosis")
HELD = "specimen={specimen}/model={model,[a-z_]+}"


rule personalise:
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
