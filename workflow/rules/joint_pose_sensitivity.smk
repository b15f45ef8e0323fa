# Study kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed.
# The jobs stand in spinepipe/studies/joint_pose_sensitivity; see `run_job` for their arguments.
from spinepipe.studies.joint_pose_sensitivity.kind import METHODS

POSES = results_of("joint_pose_sensitivity")


wildcard_constraints:
    pose="[0-9]{4,5}",
    bootstrap="start|damping",
    loading="equilibrium|quasi_static|dynamic",
    method=one_of(METHODS),
    sd_mm="[0-9.e+-]+",


include: "ranking.smk"


rule start_model:
    output:
        output=f"{POSES}/model.yaml",
    log:
        f"{LOGS}/start_model.log",
    params:
        digest=digest("start_model"),
    run:
        run_job(rule, "start_model", wildcards, input, output, log)


rule sample_landmarks:
    output:
        output=f"{POSES}/landmarks/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/sample_landmarks/specimen={{specimen}}.log",
    params:
        digest=digest("sample_landmarks"),
    run:
        run_job(rule, "sample_landmarks", wildcards, input, output, log)


rule build_models:
    input:
        landmarks=f"{RESULTS}/landmarks/specimen={{specimen}}.parquet",
    output:
        output=f"{POSES}/poses/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/build_models/specimen={{specimen}}.log",
    params:
        digest=digest("build_models"),
    run:
        run_job(rule, "build_models", wildcards, input, output, log)


rule calibrate:
    input:
        poses=f"{RESULTS}/poses/specimen={{specimen}}.parquet",
    output:
        output=f"{POSES}/calibrations/specimen={{specimen}}/pose={{pose}}.parquet",
    log:
        f"{LOGS}/calibrate/specimen={{specimen}}/pose={{pose}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("calibrate"),
    run:
        run_job(rule, "calibrate", wildcards, input, output, log)


# A checkpoint, so that a ranking that comes out the same as before computes no simulation again.
checkpoint rank_models:
    input:
        calibrations=f"{RESULTS}/calibrations.parquet",
        success=f"{RESULTS}/success.parquet",
    output:
        output=f"{POSES}/best.json",
    log:
        f"{LOGS}/rank_models.log",
    params:
        digest=digest("rank"),
    run:
        run_job(rule, "rank", wildcards, input, output, log)


rule simulate:
    input:
        unpack(stiffness_source),
        poses=f"{RESULTS}/poses/specimen={{specimen}}.parquet",
    output:
        output=f"{POSES}/jobs/specimen={{specimen}}/pose={{pose}}/stiffness={{stiffness,calibrated|best[0-9]{{2}}}}.parquet",
    log:
        f"{LOGS}/simulate/specimen={{specimen}}/pose={{pose}}-{{stiffness}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("simulate"),
    run:
        run_job(
            rule, "simulate", wildcards, input, output, log, calibration="", best=""
        )


rule bootstrap:
    output:
        output=f"{POSES}/bootstrap/specimen={{specimen}}/bootstrap={{bootstrap}}/loading={{loading}}/batch={{batch}}.parquet",
    log:
        f"{LOGS}/bootstrap/specimen={{specimen}}/{{bootstrap}}-{{loading}}-{{batch}}.log",
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


rule spread_over_landmark_sd:
    output:
        output=f"{POSES}/spread_over_landmark_sd/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/spread_over_landmark_sd/specimen={{specimen}}.log",
    params:
        digest=digest("spread_over_landmark_sd"),
    run:
        run_job(rule, "spread_over_landmark_sd", wildcards, input, output, log)


rule over_load_point:
    output:
        output=f"{POSES}/stiffness_over_load_point/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/over_load_point/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("over_load_point"),
    run:
        run_job(rule, "over_load_point", wildcards, input, output, log)


rule posterior:
    input:
        poses=f"{RESULTS}/poses/specimen={{specimen}}.parquet",
    output:
        posterior=f"{POSES}/posterior/specimen={{specimen}}.parquet",
        posterior_motion=f"{POSES}/posterior_motion/specimen={{specimen}}.parquet",
        pose_weights=f"{POSES}/pose_weights/specimen={{specimen}}.parquet",
    log:
        f"{LOGS}/posterior/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("posterior"),
    run:
        run_job(rule, "posterior", wildcards, input, output, log)
