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
        outdated("literature"),
        base_model,
    output:
        stiffness=update(f"{COHORTS}/literature/specimen={{specimen}}/stiffness.parquet"),
        errors=update(f"{COHORTS}/literature/specimen={{specimen}}/errors.parquet"),
        sign_checks=update(f"{COHORTS}/literature/specimen={{specimen}}/sign_checks.parquet"),
    log:
        f"{LOGS}/literature/specimen={{specimen}}.log",
    params:
        digest=digest("literature"),
    run:
        run_job("literature", rule, wildcards, input, output, params, log)


rule fit:
    input:
        outdated("fit"),
        base_model,
    output:
        stiffness=update(f"{COHORTS}/fits/{OWN}/stiffness.parquet"),
        fits=update(f"{COHORTS}/fits/{OWN}/fits.parquet"),
        errors=update(f"{COHORTS}/fits/{OWN}/errors.parquet"),
        nuisances=update(f"{COHORTS}/fits/{OWN}/nuisances.parquet"),
    log:
        f"{LOGS}/fits/{OWN}.log",
    params:
        digest=digest("fit"),
    run:
        run_job("fit", rule, wildcards, input, output, params, log)


rule left_out:
    input:
        outdated("left_out"),
        base_model,
        # Fits of the other specimens, of which the left-out one takes the median.
        others=lambda wildcards: layout(wildcards.study).fits_of_others(
            wildcards.specimen, wildcards.representation, wildcards.fitted_to
        ),
    output:
        stiffness=update(f"{COHORTS}/left_out/{OWN}/stiffness.parquet"),
        errors=update(f"{COHORTS}/left_out/{OWN}/errors.parquet"),
    log:
        f"{LOGS}/left_out/{OWN}.log",
    params:
        digest=digest("left_out"),
    run:
        run_job("left_out", rule, wildcards, input, output, params, log)


rule pool:
    input:
        outdated("pool"),
        base_model,
    output:
        stiffness=update(f"{COHORTS}/pooled/{POOL}/stiffness.parquet"),
        fits=update(f"{COHORTS}/pooled/{POOL}/fits.parquet"),
        errors=update(f"{COHORTS}/pooled/{POOL}/errors.parquet"),
        pooling=update(f"{COHORTS}/pooled/{POOL}/pooling.parquet"),
    log:
        f"{LOGS}/pooled/{POOL}.log",
    params:
        digest=digest("pool"),
    run:
        run_job("pool", rule, wildcards, input, output, params, log)


rule experiment:
    input:
        outdated("experiment"),
        base_model,
        # The specimen's own fit to all load cases, with which its tests are simulated.
        fitted=lambda wildcards: layout(wildcards.study).simulated_fit(wildcards.specimen),
    output:
        load_displacement=update(
            f"{COHORTS}/experiment/specimen={{specimen}}/load_displacement.parquet"
        ),
        helical_axes=update(f"{COHORTS}/experiment/specimen={{specimen}}/helical_axes.parquet"),
    log:
        f"{LOGS}/experiment/specimen={{specimen}}.log",
    params:
        digest=digest("experiment"),
    run:
        run_job("experiment", rule, wildcards, input, output, params, log)
