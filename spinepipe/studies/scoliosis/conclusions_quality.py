"""Whether results of scoliotic spines can be trusted; the sentences stand in conclusions.csv."""

from collections.abc import Iterator, Mapping
from math import comb

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import listed
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis.errors import REFERENCE
from spinepipe.studies.scoliosis.errors_compared import FILMS, LAWS, SIGNIFICANT, Compared

MANY = 0.1
"""Share of poses or fits lost above which the others no longer stand for all."""


def quality(results: ResultTables, *groups: Compared) -> Iterator[Conclusion]:
    """All lights but those of the reading noise and of what was varied."""
    positions, laws = results.table("positions"), results.table("laws")
    if len(positions):
        yield from _poses(positions)
    for compared in groups:
        yield from _spines(compared)
    yield from _sample(groups[0])
    if len(laws):
        yield from _fits(laws)
        yield from _segments(laws)
    lacking = results.table("not_read")
    if len(lacking):
        made = dict(tuple(lacking.groupby("made_of_it")))
        none = lacking[:0]
        counts = {
            "spines": lacking["specimen"].nunique(),
            "between": len(made.get("interpolated", none)),
            "shortened": made.get("spine_shortened", none)["specimen"].nunique(),
            "films": len(made.get("film_left_out", none).groupby(["specimen", "position"])),
        }
        yield Conclusion("not_read", "check", numbers_from("not_read: made_of_it", **counts))
    population = results.table("population")
    if "status" in population and (population["status"] == Status.NOT_CONVERGED.value).any():
        yield Conclusion("population", "check")


def _poses(positions: pd.DataFrame) -> Iterator[Conclusion]:
    status = positions["status"]
    unstable = int((status == PrescribedStatus.UNSTABLE.value).sum())
    gave_up = int((status == PrescribedStatus.NOT_CONVERGED.value).sum())
    lost, poses = unstable + gave_up, len(positions)
    verdict = "ok" if not lost else "check" if lost <= MANY * poses else "stop"
    counts = numbers_from("positions: status", lost=lost, poses=poses, unstable=unstable)
    yield Conclusion("poses", verdict, counts | numbers_from("positions: status", gave_up=gave_up))
    missed = positions[status == PrescribedStatus.UNREACHABLE.value]
    if len(missed):
        most = Value(float(missed["missed_mm"].max()), "mm", source="positions: missed_mm")
        values = numbers_from("positions: status", missed=len(missed), poses=poses)
        yield Conclusion("reached", "check", {**values, "mm": most})


def _spines(compared: Compared) -> Iterator[Conclusion]:
    """Whether laws have the poses of the same spines."""
    if compared.each.empty:
        return
    n, spines = len(compared.same), len(compared.each)
    values = numbers_from("positions: spines with all poses", n=n, spines=spines)
    names = {"films": FILMS[compared.group]}
    yield Conclusion("spines", "ok" if n == spines else "check", values, names)


def _sample(left_out: Compared) -> Iterator[Conclusion]:
    """Whether there are so many spines that a corrected test can be significant at all."""
    laws, n = len(left_out.each.columns), len(left_out.same)
    if laws < 2:
        return
    pairs = comb(laws, 2)
    # the least p of an exact signed rank test is 2^(1 - n), times all pairs by Holm's first step
    needed = int(np.floor(np.log2(2.0 * pairs / SIGNIFICANT))) + 1
    values = numbers_from("statistics: least p of pairs", n=n, pairs=pairs, needed=needed)
    yield Conclusion("sample", "ok" if n >= needed else "check", values)


def _fits(laws: pd.DataFrame) -> Iterator[Conclusion]:
    """Fits through the simulator, and those of the reference that end at a bound."""
    fits = laws.dropna(subset=["fit_status"]).drop_duplicates(["specimen", "model"])
    if fits.empty:
        return
    lost = int((fits["fit_status"] == Status.NOT_CONVERGED.value).sum())
    several = int((fits["n_optima"] > 1).sum())
    verdict = "check" if lost else "check_several" if several else "ok"
    if lost > MANY * len(fits):
        verdict = "stop"
    source = "laws: fit_status, n_optima"
    yield Conclusion(
        "fits", verdict, numbers_from(source, lost=lost, several=several, fits=len(fits))
    )
    reference = fits[fits["model"] == REFERENCE]
    if len(reference):
        held = int((reference["fit_status"] == Status.CONVERGED_AT_BOUND.value).sum())
        values = numbers_from("laws: fit_status", held=held, spines=len(reference))
        yield Conclusion("bounds", "check" if held else "ok", values, {"law": LAWS[REFERENCE]})


def _segments(laws: pd.DataFrame) -> Iterator[Conclusion]:
    """Segments of which bending films say little."""
    held = laws[laws["constrained"].astype(bool)]
    names: Mapping[str, str] = {
        "laws": listed(LAWS[name] for name in LAWS if (held["model"] == name).any())
    }
    values = numbers_from("laws: constrained", held=len(held), all=len(laws))
    yield Conclusion("constrained", "check" if len(held) else "ok", values, names)
    segments = laws.drop_duplicates(["specimen", "joint"])
    against = int(segments["opposite"].astype(bool).sum())
    values = numbers_from("laws: opposite", against=against, segments=len(segments))
    yield Conclusion("opposite", "check" if against else "ok", values)
