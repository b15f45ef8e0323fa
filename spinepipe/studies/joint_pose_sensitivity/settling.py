"""What is to be said where motion was not simulated at rest."""

from spinepipe.report.words import tick
from spinepipe.studies import JointPoseSensitivity


def settling(study: JointPoseSensitivity) -> str:
    """A sentence where simulations show another time than the fits do, else nothing."""
    if study.loading != "settle":
        return ""
    return (
        f"Motion was simulated {tick(study.settle_time_s)} s after loading, while stiffness was "
        "fitted at rest: errors hold what had not settled."
    )
