# Study kind cohort_stiffness: how stiffness differs between specimens, levels and load cases.
# The jobs stand in spinepipe/studies/cohort_stiffness.

COHORTS = results_of("cohort_stiffness")
OWN = "specimen-{specimen}/representation-{representation}/fitted_to-{fitted_to}"
POOL = "representation-{representation}/fitted_to-{fitted_to}/without-{without}"


wildcard_constraints:
    representation="[a-z_]+",
    fitted_to="[^/=]+",
    without="[^/=]+",


rule literature:
    input:
        outdated("literature"),
        PROJECT.base_model,
    output:
        **tables_in(
            f"{COHORTS}/literature",
            "stiffness",
            "errors",
            "sign_checks",
            of="specimen-{specimen}",
        ),
    log:
        f"{LOGS}/literature/specimen-{{specimen}}.log",
    params:
        digest=digest("literature"),
    run:
        run_job("literature", rule, wildcards, input, output, params, log)


rule fit:
    input:
        outdated("fit"),
        PROJECT.base_model,
    output:
        **tables_in(f"{COHORTS}/fits", "stiffness", "fits", "errors", "nuisances", of=OWN),
    log:
        f"{LOGS}/fits/{OWN}.log",
    params:
        digest=digest("fit"),
    run:
        run_job("fit", rule, wildcards, input, output, params, log)


rule left_out:
    input:
        outdated("left_out"),
        PROJECT.base_model,
        # Fits of the other specimens, of which the left-out one takes the median.
        others=lambda wildcards: layout(wildcards.study).fits_of_others(
            wildcards.specimen, wildcards.representation, wildcards.fitted_to
        ),
    output:
        **tables_in(f"{COHORTS}/left_out", "stiffness", "errors", of=OWN),
    log:
        f"{LOGS}/left_out/{OWN}.log",
    params:
        digest=digest("left_out"),
    run:
        run_job("left_out", rule, wildcards, input, output, params, log)


rule pool:
    input:
        outdated("pool"),
        PROJECT.base_model,
    output:
        **tables_in(f"{COHORTS}/pooled", "stiffness", "fits", "errors", "pooling", of=POOL),
    log:
        f"{LOGS}/pooled/{POOL}.log",
    params:
        digest=digest("pool"),
    run:
        run_job("pool", rule, wildcards, input, output, params, log)


rule experiment:
    input:
        outdated("experiment"),
        PROJECT.base_model,
        # The specimen's own fit to all load cases, with which its tests are simulated.
        fitted=lambda wildcards: layout(wildcards.study).simulated_fit(wildcards.specimen),
    output:
        **tables_in(
            f"{COHORTS}/experiment",
            "load_displacement",
            "helical_axes",
            of="specimen-{specimen}",
        ),
    log:
        f"{LOGS}/experiment/specimen-{{specimen}}.log",
    params:
        digest=digest("experiment"),
    run:
        run_job("experiment", rule, wildcards, input, output, params, log)
