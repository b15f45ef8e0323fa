"""What `spinepipe check` says of a study: how much of the free stiffness the data tell."""

from pathlib import Path

from spinepipe.calibration.uncertainty import Rank, rank_at_start
from spinepipe.cohort import Cohort
from spinepipe.model import RefusedModel
from spinepipe.problems import InputProblem
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.study import STUDIES
from spinepipe.units import COORDINATES, to_si

KEY = "calibration.free"


def told(
    study: JointPoseSensitivity, cohort: Cohort, root: Path
) -> tuple[str, tuple[InputProblem, ...]]:
    """In words how many of the free stiffnesses the data tell, and what is warned of.

    In the cohort's own joint poses, at the stiffness where fits start.
    """
    ranks = {name: _rank(study, cohort, root, name) for name in cohort.specimen_names}
    known = [found.rank for found in ranks.values() if found.rank is not None]
    free = len(next(iter(ranks.values())).silent)
    names = ", ".join(study.calibration.free)
    if not known:
        return f"free: {names}; no start stands, so that their number is not known", ()
    least, most = min(known), max(known)
    number = f"{least}" if least == most else f"{least} to {most}, by specimen,"
    words = f"the data tell {number} of {free} free stiffnesses ({names})"
    return words, tuple(_warned(study, cohort, ranks))


def _rank(study: JointPoseSensitivity, cohort: Cohort, root: Path, specimen: str) -> Rank:
    sd = cohort.reading_sd()
    noise = None if sd is None else to_si(sd)
    try:
        problem = calibration_problem(str(root), study, specimen)
        return rank_at_start(problem, noise, study.calibration.identifiable_below)
    except RefusedModel as error:
        return Rank(None, (False,) * len(study.calibration.free), str(error))


def _warned(
    study: JointPoseSensitivity, cohort: Cohort, ranks: dict[str, Rank]
) -> list[InputProblem]:
    """One warning for all specimens whose data tell less than is free."""
    short = {
        name: found
        for name, found in ranks.items()
        if found.rank is not None and found.rank < len(found.silent)
    }
    if not short:
        return []
    worst = min(short, key=lambda name: short[name].rank or 0)
    found, free = short[worst], study.calibration.free
    joints = len(found.silent) // len(free)
    of = {  # unknowns stand coordinate by coordinate, each joint by joint
        name: found.silent[at * joints : (at + 1) * joints] for at, name in enumerate(free)
    }
    silent = [name for name in sorted(free, key=COORDINATES.index) if all(of[name])]
    told_words = f"{len(found.silent)} stiffnesses, of which the data of {worst} tell {found.rank}"
    keep = f": {', '.join(silent)} would keep {'its' if len(silent) == 1 else 'their'} start"
    remedy = f"write `free: auto` or leave some out{keep if silent else ''}"
    place = (f"{STUDIES.as_posix()}/{study.study}.yaml", None, KEY)
    return [InputProblem(*place, told_words, "as many as the data tell", remedy)]
