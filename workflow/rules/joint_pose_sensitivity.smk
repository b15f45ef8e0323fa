# Study kind joint_pose_sensitivity: how much of the answer hangs on where joints were placed.
# Each job is a function `run` of spinepipe.jobs; see `run_job` for how its arguments are named.


rule sample_landmarks:
    output:
        output=f"{RESULTS}/landmarks.parquet",
    params:
        digest=lambda wildcards: digests("sample_landmarks", wildcards.study),
    log:
        f"{LOGS}/sample_landmarks.log",
    run:
        run_job("sample_landmarks", wildcards, input, output, log)


rule build_models:
    input:
        landmarks=f"{RESULTS}/landmarks.parquet",
    output:
        output=f"{RESULTS}/poses.parquet",
        model=f"{RESULTS}/model.yaml",
    params:
        digest=lambda wildcards: digests("build_models", wildcards.study),
    log:
        f"{LOGS}/build_models.log",
    run:
        run_job("build_models", wildcards, input, output, log)


rule calibrate:
    input:
        poses=f"{RESULTS}/poses.parquet",
    output:
        output=f"{RESULTS}/calibrations/specimen={{specimen}}/pose={{pose}}.parquet",
    params:
        digest=lambda wildcards: digests("calibrate", wildcards.study),
    log:
        f"{LOGS}/calibrate/specimen={{specimen}}/pose={{pose}}.log",
    run:
        run_job("calibrate", wildcards, input, output, log)


rule aggregate_calibration_block:
    input:
        calibrations_of_block,
    output:
        f"{RESULTS}/blocks/calibrations/specimen={{specimen}}/block={{block}}.parquet",
    params:
        digest=digests("collect"),
    log:
        f"{LOGS}/blocks/calibrations/specimen={{specimen}}/block={{block}}.log",
    run:
        collect("calibrations", wildcards, input, output, log)


rule aggregate_calibrations:
    input:
        block_files("calibrations"),
    output:
        f"{RESULTS}/calibrations.parquet",
    params:
        digest=digests("collect"),
    log:
        f"{LOGS}/calibrations.log",
    run:
        collect("calibrations", wildcards, input, output, log)


# A checkpoint, so that a ranking that comes out the same as before computes no simulation again.
checkpoint rank_models:
    input:
        calibrations=f"{RESULTS}/calibrations.parquet",
    output:
        output=f"{RESULTS}/best.json",
    params:
        digest=lambda wildcards: digests("rank", wildcards.study),
    log:
        f"{LOGS}/rank_models.log",
    run:
        run_job("rank", wildcards, input, output, log)


rule simulate:
    input:
        unpack(stiffness_source),
        poses=f"{RESULTS}/poses.parquet",
    output:
        output=f"{RESULTS}/jobs/specimen={{specimen}}/pose={{pose}}/stiffness={{stiffness}}.parquet",
    params:
        digest=lambda wildcards: digests("simulate", wildcards.study),
    log:
        f"{LOGS}/simulate/specimen={{specimen}}/pose={{pose}}-{{stiffness}}.log",
    run:
        run_job("simulate", wildcards, input, output, log, calibration="", best="")


rule aggregate_simulation_block:
    input:
        simulations_of_block,
    output:
        f"{RESULTS}/blocks/simulations/specimen={{specimen}}/block={{block}}.parquet",
    params:
        digest=digests("collect"),
    log:
        f"{LOGS}/blocks/simulations/specimen={{specimen}}/block={{block}}.log",
    run:
        collect("simulations", wildcards, input, output, log)


rule aggregate_simulations:
    input:
        block_files("simulations"),
    output:
        f"{RESULTS}/simulations.parquet",
    params:
        digest=digests("collect"),
    log:
        f"{LOGS}/simulations.log",
    run:
        collect("simulations", wildcards, input, output, log)


rule figures:
    input:
        poses=f"{RESULTS}/poses.parquet",
        calibrations=f"{RESULTS}/calibrations.parquet",
        simulations=f"{RESULTS}/simulations.parquet",
    output:
        stiffness=figure("stiffness"),
        errors=figure("errors"),
        joint_pose=figure("joint_pose"),
    params:
        digest=lambda wildcards: digests("figures", wildcards.study),
    log:
        f"{LOGS}/figures.log",
    run:
        run_job("figures", wildcards, input, output, log)
