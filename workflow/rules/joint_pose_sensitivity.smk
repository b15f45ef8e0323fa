# Study kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed.
# Each job is a function `run` of spinepipe.jobs; see `run_job` for how its arguments are named.
POSES = results_of("joint_pose_sensitivity")


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
        output=f"{POSES}/jobs/specimen={{specimen}}/pose={{pose}}/stiffness={{stiffness}}.parquet",
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
