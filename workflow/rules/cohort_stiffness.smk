# Study kind cohort_stiffness: how stiffness differs between specimens, levels and load cases.
# The jobs stand in spinepipe/studies/cohort_stiffness.

COHORTS = results_of("cohort_stiffness")
OWN = "specimen={specimen}/representation={representation}/fitted_to={fitted_to}"
POOL = "representation={representation}/fitted_to={fitted_to}/without={without}"


wildcard_constraints:
    representation="[a-z_]+",
    fitted_to="[^/=]+",
    without="[^/=]+",


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
        digest=digest("literature"),
    run:
        run_job(rule, "literature", wildcards, input, output, log)


rule fit:
    input:
        base_model,
    output:
        stiffness=f"{COHORTS}/fits/{OWN}/stiffness.parquet",
        fits=f"{COHORTS}/fits/{OWN}/fits.parquet",
        errors=f"{COHORTS}/fits/{OWN}/errors.parquet",
        nuisances=f"{COHORTS}/fits/{OWN}/nuisances.parquet",
    log:
        f"{LOGS}/fits/{OWN}.log",
    params:
        digest=digest("fit"),
    run:
        run_job(rule, "fit", wildcards, input, output, log)


rule left_out:
    input:
        base_model,
        # Fits of the other specimens, of which the left-out one takes the median.
        others=lambda wildcards: layout(wildcards.study).fits_of_others(
            wildcards.specimen, wildcards.representation, wildcards.fitted_to
        ),
    output:
        stiffness=f"{COHORTS}/left_out/{OWN}/stiffness.parquet",
        errors=f"{COHORTS}/left_out/{OWN}/errors.parquet",
    log:
        f"{LOGS}/left_out/{OWN}.log",
    params:
        digest=digest("left_out"),
    run:
        run_job(rule, "left_out", wildcards, input, output, log)


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
        digest=digest("pool"),
    run:
        run_job(rule, "pool", wildcards, input, output, log)


rule experiment:
    input:
        base_model,
        # The specimen's own fit to all load cases, with which its tests are simulated.
        fitted=lambda wildcards: layout(wildcards.study).simulated_fit(
            wildcards.specimen
        ),
    output:
        load_displacement=f"{COHORTS}/experiment/specimen={{specimen}}/load_displacement.parquet",
        helical_axes=f"{COHORTS}/experiment/specimen={{specimen}}/helical_axes.parquet",
    log:
        f"{LOGS}/experiment/specimen={{specimen}}.log",
    params:
        digest=digest("experiment"),
    run:
        run_job(rule, "experiment", wildcards, input, output, log)
