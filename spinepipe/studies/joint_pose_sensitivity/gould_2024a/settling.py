"""Why fits of a bootstrap end apart: what is sampled, and how fast a spine settles."""

from spinepipe.comparison.paper import PAPER


def slowest_s() -> float:
    """Longest time constant of a joint's spring and damper in the paper, s."""
    start, best = PAPER["start_stiffness"], PAPER["best_model"]["stiffness"]
    translation = min(float(best["anterior_n_per_m"]), float(start["right_n_per_m"]))
    return max(
        float(PAPER["damping"]["translation_n_s_per_m"]) / translation,
        float(PAPER["damping"]["rotation_nm_s_per_rad"]) / float(best["extension_nm_per_rad"]),
    )


_OPTIMISER = "what spread the paper's optimiser adds cannot be told without its runs"
SPREAD = {
    ("start", "quasi_static"): "sets differ in the stiffnesses that are not fitted too, so each "
    f"is a problem of its own; {_OPTIMISER}",
    ("start", "dynamic"): "sets differ in the stiffnesses that are not fitted too, so each is a "
    f"problem of its own; {_OPTIMISER}",
    ("damping", "quasi_static"): "the paper's range of damping is not published; with its start "
    f"values joints settle with time constants up to {slowest_s():.2f} s, far below the "
    f"{float(PAPER['settling']['time_s']):g} s of a run (A37), with ten times that damping up to "
    f"{10.0 * slowest_s():.1f} s",
    ("damping", "dynamic"): "the paper's range of damping is not published, and what is read at "
    "the end of a ramp hangs on damping",
}
"""Reasons by what is sampled and the loading."""
