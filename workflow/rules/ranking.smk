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


WAITING["simulations"] = [when_ranked]
