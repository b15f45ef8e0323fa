"""Finding about variance: which of joint pose and stiffness takes more, where that is known."""

from spinepipe.report.page.results import Results
from spinepipe.report.words import count
from spinepipe.studies import JointPoseSensitivity


def dominant(study: JointPoseSensitivity, results: Results) -> str:
    """In how many errors pose or stiffness takes more, their 95 % intervals apart."""
    rows = results.table("variance_shares")
    if rows.empty:
        return ""
    done = rows[rows["status"] == "done"]
    keys = ["specimen", "joint", "coordinate"]
    pose, stiffness = (
        done[done["factor"] == factor].set_index(keys) for factor in ("pose", "stiffness")
    )
    if pose.empty:
        return ""
    stiffness = stiffness.reindex(pose.index)
    by_pose = int((pose["share_low"] > stiffness["share_high"]).sum())
    by_stiffness = int((stiffness["share_low"] > pose["share_high"]).sum())
    unknown = len(pose) - by_pose - by_stiffness
    overlap = "cannot be told apart: the 95 % intervals of their shares of the variance overlap."
    errors = f"{count(len(pose), 'error')} (one per joint and direction)"
    if unknown == len(pose):
        return (
            f"In none of {errors} is it clear which counts more: joint pose and stiffness {overlap}"
        )
    told = (
        f"Of {errors}, joint pose takes more of the variance than stiffness in {by_pose} and "
        f"stiffness more in {by_stiffness}."
    )
    return f"{told} In the other {unknown} they {overlap}" if unknown else told
