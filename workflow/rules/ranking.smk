# Study kind joint_pose_sensitivity: what waits for the ranking of its models.


def stiffness_source(wildcards):
    """Where a simulation takes its stiffness from: its own calibration or the ranking.

    Of the ranking its own set alone counts, which is part of its mark.
    """
    folder = f"results/{wildcards.study}"
    if wildcards.stiffness != "calibrated":
        ranked = checkpoints.rank_models.get(study=wildcards.study)
        return {"best": ancient(ranked.output[0])}
    file = f"specimen={wildcards.specimen}/pose={wildcards.pose}.parquet"
    return {"calibration": f"{folder}/calibrations/{file}"}


def when_ranked(wildcards):
    """Simulations are known only once the models are ranked.

    A new ranking with the same content then leaves them as they are.
    """
    if load(wildcards.study)[0].kind == "joint_pose_sensitivity":
        checkpoints.rank_models.get(study=wildcards.study)


@cache
def simulations_to_do(name):
    """Simulations of a study that had no file when first asked for: none is made before the ranking."""
    return layout(name).simulations_to_do()


def simulations_foreseen(jobs):
    names = {job.wildcards.study for job in jobs if job.rule.name == "rank_models"}
    return sum(simulations_to_do(name) for name in names)


WAITING["simulations"] = [when_ranked]
FORESEEN["simulate"] = simulations_foreseen
