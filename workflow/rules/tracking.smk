# Study kind tracking: motions of the spine from markers on the skin.
# The jobs stand in spinepipe/studies/tracking.

TRACKED = results_of("tracking")
JOBS = f"{TRACKED}/jobs"


# Passive elements from the trials of one kind, or of two kinds together.
rule calibrate_passive:
    input:
        outdated("calibrate_passive", "calibrate"),
    output:
        output=update(f"{JOBS}/stiffness/specimen-{{specimen}}/law-{{law,[a-z_]+}}.parquet"),
    log:
        f"{LOGS}/calibrate_passive/specimen-{{specimen}}/{{law}}.log",
    params:
        digest=digest("calibrate"),
    run:
        run_job("calibrate", rule, wildcards, input, output, params, log)


rule track:
    input:
        outdated("track"),
        law=lambda wildcards: layout(wildcards.study).law_files(
            wildcards.specimen, wildcards.trial, wildcards.approach
        ),
    output:
        **tables_in(
            JOBS,
            "tracked",
            "fits",
            "drawn",
            of="specimen-{specimen}/trial-{trial}/approach-{approach,[a-z_0-9]+}",
        ),
    log:
        f"{LOGS}/track/specimen-{{specimen}}/trial-{{trial}}/{{approach}}.log",
    params:
        digest=digest("track"),
    run:
        run_job("track", rule, wildcards, input, output, params, log)


rule profile_stiffness:
    input:
        outdated("profile_stiffness", "profile"),
    output:
        **tables_in(
            JOBS,
            "profiles",
            "profile_points",
            of="specimen-{specimen}/region-{region}/coordinate-{coordinate,[a-z_]+}",
        ),
    log:
        f"{LOGS}/profile_stiffness/specimen-{{specimen}}/{{region}}_{{coordinate}}.log",
    params:
        digest=digest("profile"),
    run:
        run_job("profile", rule, wildcards, input, output, params, log)


rule weigh_loads:
    input:
        outdated("weigh_loads", "weigh"),
    output:
        output=update(f"{JOBS}/weights/specimen-{{specimen}}.parquet"),
    log:
        f"{LOGS}/weigh_loads/specimen-{{specimen}}.log",
    params:
        digest=digest("weigh"),
    run:
        run_job("weigh", rule, wildcards, input, output, params, log)


# Clusters, size and what is remarkable of a person's recordings.
rule examine_recordings:
    input:
        outdated("examine_recordings", "examine"),
    output:
        **tables_in(JOBS, "clusters", "remarks", "sizes", of="specimen-{specimen}"),
    log:
        f"{LOGS}/examine_recordings/specimen-{{specimen}}.log",
    params:
        digest=digest("examine"),
    run:
        run_job("examine", rule, wildcards, input, output, params, log)


# What OpenSim replays.
rule export_skeleton:
    input:
        outdated("export_skeleton", "skeleton"),
    output:
        output=update(f"{TRACKED}/opensim/{{specimen}}.osim"),
    log:
        f"{LOGS}/export_skeleton/specimen-{{specimen}}.log",
    params:
        digest=digest("skeleton"),
    run:
        run_job("skeleton", rule, wildcards, input, output, params, log)


rule export_motion:
    input:
        outdated("export_motion", "motion"),
        tracked=f"{RESULTS}/jobs/tracked/specimen-{{specimen}}/trial-{{trial}}/approach-{{approach}}.parquet",
    output:
        output=update(f"{TRACKED}/opensim/{{specimen}}/{{trial}}/{{approach,[a-z_0-9]+}}.mot"),
    log:
        f"{LOGS}/export_motion/specimen-{{specimen}}/trial-{{trial}}/{{approach}}.log",
    params:
        digest=digest("motion"),
    run:
        run_job("motion", rule, wildcards, input, output, params, log)
