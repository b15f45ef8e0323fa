# Study kind tracking: motions of the spine from markers on the skin.
# The jobs stand in spinepipe/studies/tracking.

TRACKED = results_of("tracking")
PERSON = f"{TRACKED}/jobs/specimen={{specimen}}"


# Passive elements from the trials of one kind, or of two kinds together.
rule calibrate_passive:
    output:
        output=f"{PERSON}/law={{law,[a-z_]+}}/stiffness.parquet",
    log:
        f"{LOGS}/calibrate_passive/specimen={{specimen}}/{{law}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("calibrate"),
    run:
        run_job(rule, "calibrate", wildcards, input, output, log)


rule track:
    input:
        law=lambda wildcards: layout(wildcards.study).law_files(
            wildcards.specimen, wildcards.trial, wildcards.approach
        ),
    output:
        tracked=f"{PERSON}/trial={{trial}}/approach={{approach,[a-z_0-9]+}}/tracked.parquet",
        fits=f"{PERSON}/trial={{trial}}/approach={{approach,[a-z_0-9]+}}/fits.parquet",
        drawn=f"{PERSON}/trial={{trial}}/approach={{approach,[a-z_0-9]+}}/drawn.parquet",
    log:
        f"{LOGS}/track/specimen={{specimen}}/trial={{trial}}/{{approach}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("track"),
    run:
        run_job(rule, "track", wildcards, input, output, log)


rule profile_stiffness:
    output:
        profiles=f"{PERSON}/region={{region}}/coordinate={{coordinate,[a-z_]+}}/profiles.parquet",
        profile_points=f"{PERSON}/region={{region}}/coordinate={{coordinate,[a-z_]+}}/profile_points.parquet",
    log:
        f"{LOGS}/profile_stiffness/specimen={{specimen}}/{{region}}_{{coordinate}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("profile"),
    run:
        run_job(rule, "profile", wildcards, input, output, log)


rule weigh_loads:
    output:
        output=f"{PERSON}/weights.parquet",
    log:
        f"{LOGS}/weigh_loads/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("weigh"),
    run:
        run_job(rule, "weigh", wildcards, input, output, log)


# Clusters, size and what is remarkable of a person's recordings.
rule examine_recordings:
    output:
        clusters=f"{PERSON}/clusters.parquet",
        remarks=f"{PERSON}/remarks.parquet",
        sizes=f"{PERSON}/sizes.parquet",
    log:
        f"{LOGS}/examine_recordings/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("examine"),
    run:
        run_job(rule, "examine", wildcards, input, output, log)


# What OpenSim replays.
rule export_skeleton:
    output:
        output=f"{TRACKED}/opensim/{{specimen}}.osim",
    log:
        f"{LOGS}/export_skeleton/specimen={{specimen}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("skeleton"),
    run:
        run_job(rule, "skeleton", wildcards, input, output, log)


rule export_motion:
    input:
        tracked=f"{RESULTS}/jobs/specimen={{specimen}}/trial={{trial}}/approach={{approach}}/tracked.parquet",
    output:
        output=f"{TRACKED}/opensim/{{specimen}}/{{trial}}/{{approach,[a-z_0-9]+}}.mot",
    log:
        f"{LOGS}/export_motion/specimen={{specimen}}/trial={{trial}}/{{approach}}.log",
    resources:
        tmpdir=TMPDIR,
    params:
        digest=digest("motion"),
    run:
        run_job(rule, "motion", wildcards, input, output, log)
