# Study kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed.
# The jobs stand in spinepipe/studies/joint_pose_sensitivity; see `run_job` for their arguments.
from spinepipe.studies.joint_pose_sensitivity.settings import METHODS

POSES = results_of("joint_pose_sensitivity")


wildcard_constraints:
    pose="[0-9]{4,5}",
    bootstrap="start|damping",
    loading="equilibrium|quasi_static|dynamic",
    method=one_of(METHODS),
    sd_mm="[0-9.e+-]+",


rule start_model:
    input:
        outdated("start_model"),
    output:
        output=update(f"{POSES}/model.yaml"),
    log:
        f"{LOGS}/start_model.log",
    params:
        digest=digest("start_model"),
    run:
        run_job("start_model", rule, wildcards, input, output, params, log)


rule sample_landmarks:
    input:
        outdated("sample_landmarks"),
    output:
        output=update(f"{POSES}/landmarks/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/sample_landmarks/specimen-{{specimen}}.log",
    params:
        digest=digest("sample_landmarks"),
    run:
        run_job("sample_landmarks", rule, wildcards, input, output, params, log)


rule build_models:
    input:
        outdated("build_models"),
        landmarks=f"{RESULTS}/landmarks/specimen-{{specimen}}.parquet",
    output:
        output=update(f"{POSES}/poses/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/build_models/specimen-{{specimen}}.log",
    params:
        digest=digest("build_models"),
    run:
        run_job("build_models", rule, wildcards, input, output, params, log)


# Poses of a specimen, fitted side by side.
rule calibrations_block:
    input:
        outdated_block("calibrations_block", part="calibrate", job="calibrate"),
        poses=f"{RESULTS}/poses/specimen-{{specimen}}.parquet",
    output:
        output=update(f"{POSES}/blocks/{{table,calibrations}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule calibrations_block as calibrate with:
    output:
        output=update(f"{POSES}/calibrations/specimen-{{specimen}}/pose-{{pose}}.parquet"),
    log:
        f"{LOGS}/calibrate/specimen-{{specimen}}/pose-{{pose}}.log",
    params:
        digest=digest("calibrate"),
        table="calibrations",


rule rank_models:
    input:
        outdated("rank_models", "rank"),
        calibrations=f"{RESULTS}/calibrations.parquet",
    output:
        output=update(f"{POSES}/best.json"),
    log:
        f"{LOGS}/rank_models.log",
    params:
        digest=digest("rank"),
    run:
        run_job("rank", rule, wildcards, input, output, params, log)


# Each pose with its own stiffness and with the best sets of all poses.
rule simulations_block:
    input:
        outdated_block("simulations_block", part="simulate", job="simulate"),
        poses=f"{RESULTS}/poses/specimen-{{specimen}}.parquet",
        calibrations=lambda wildcards: layout(wildcards.study).blocks_of_calibrations(
            wildcards.specimen
        ),
    output:
        output=update(f"{POSES}/blocks/{{table,simulations}}/{OF_BLOCK}.parquet"),
    log:
        f"{LOGS}/blocks/{{table}}/{OF_BLOCK}.log",
    params:
        digest=PROJECT.mark_of_block,
    run:
        run_job(BLOCK, rule, wildcards, input, output, params, log)


# One file by its name, such as one that got lost.
use rule simulations_block as simulate with:
    output:
        output=update(
            f"{POSES}/jobs/specimen-{{specimen}}/pose-{{pose}}/stiffness-{{stiffness,calibrated|best[0-9]{{2}}}}.parquet"
        ),
    log:
        f"{LOGS}/simulate/specimen-{{specimen}}/pose-{{pose}}-{{stiffness}}.log",
    params:
        digest=digest("simulate"),
        table="simulations",


rule bootstrap:
    input:
        outdated("bootstrap"),
    output:
        output=update(
            f"{POSES}/bootstrap/specimen-{{specimen}}/bootstrap-{{bootstrap}}/loading-{{loading}}/batch-{{batch}}.parquet"
        ),
    log:
        f"{LOGS}/bootstrap/specimen-{{specimen}}/{{bootstrap}}-{{loading}}-{{batch}}.log",
    params:
        digest=digest("bootstrap"),
    run:
        run_job("bootstrap", rule, wildcards, input, output, params, log)


rule fit_by_method:
    input:
        outdated("fit_by_method"),
        poses=f"{RESULTS}/poses/specimen-{{specimen}}.parquet",
    output:
        output=update(
            f"{POSES}/methods/specimen-{{specimen}}/pose-{{pose}}/method-{{method}}.parquet"
        ),
    log:
        f"{LOGS}/methods/specimen-{{specimen}}/pose-{{pose}}-{{method}}.log",
    params:
        digest=digest("fit_by_method"),
    run:
        run_job("fit_by_method", rule, wildcards, input, output, params, log)


rule landmark_errors:
    input:
        outdated("landmark_errors"),
    output:
        output=update(f"{POSES}/precision/specimen-{{specimen}}/sd_mm-{{sd_mm}}.parquet"),
    log:
        f"{LOGS}/precision/specimen-{{specimen}}/sd_mm-{{sd_mm}}.log",
    params:
        digest=digest("landmark_errors"),
    run:
        run_job("landmark_errors", rule, wildcards, input, output, params, log)


rule spread_over_landmark_sd:
    input:
        outdated("spread_over_landmark_sd"),
    output:
        output=update(f"{POSES}/spread_over_landmark_sd/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/spread_over_landmark_sd/specimen-{{specimen}}.log",
    params:
        digest=digest("spread_over_landmark_sd"),
    run:
        run_job("spread_over_landmark_sd", rule, wildcards, input, output, params, log)


rule over_load_point:
    input:
        outdated("over_load_point"),
    output:
        output=update(f"{POSES}/stiffness_over_load_point/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/over_load_point/specimen-{{specimen}}.log",
    params:
        digest=digest("over_load_point"),
    run:
        run_job("over_load_point", rule, wildcards, input, output, params, log)


rule posterior:
    input:
        outdated("posterior"),
        poses=f"{RESULTS}/poses/specimen-{{specimen}}.parquet",
    output:
        posterior=update(f"{POSES}/posterior/specimen-{{specimen}}.parquet"),
        posterior_motion=update(f"{POSES}/posterior_motion/specimen-{{specimen}}.parquet"),
        pose_weights=update(f"{POSES}/pose_weights/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/posterior/specimen-{{specimen}}.log",
    params:
        digest=digest("posterior"),
    run:
        run_job("posterior", rule, wildcards, input, output, params, log)
