"""What a study of tracked motions concludes; the sentences stand in conclusions.csv."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import LUMBAR_JOINTS
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import count, level, listed, plain
from spinepipe.studies.tracking.conclusions_of_errors import (
    ENDED,
    MANY_LOST,
    Tables,
    conclusions_of_errors,
)
from spinepipe.studies.tracking.conclusions_of_stiffness import conclusions_of_stiffness
from spinepipe.studies.tracking.ranking import (
    FEWEST,
    LEVEL,
    Ranking,
    chosen_approach,
    paired_p,
    rankings,
)
from spinepipe.studies.tracking.settings import CONSTRAINED, Tracking
from spinepipe.studies.tracking.sharing import sharing_rows, similarity_rows
from spinepipe.studies.tracking.tables import TOLD, TOO_FEW, WINDOW
from spinepipe.studies.tracking.trials import kinds_of_trials
from spinepipe.studies.tracking.true_motions import true_motions
from spinepipe.studies.tracking.words import phrase, sort_approaches

ACCELERATION = "acceleration_rms_deg_per_s2"

CLEARLY = 0.1
"""Coefficients of multiple correlation that differ by more than this are not alike."""

UNLIKE = 10.0
"""Percent by which a size differs from the skeleton's before it matters."""

MOST_NAMES = 3


def conclusions(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[Conclusion]:
    """All of them."""
    tables: Tables = defaultdict(pd.DataFrame, results.tables)
    errors = tables["errors"]
    found = rankings(cohort, errors)
    yield from conclusions_of_errors(tables, found)
    yield from conclusions_of_stiffness(study, cohort, tables)
    moved = tables["sharing"]
    if len(moved):
        name = chosen_approach(cohort, errors, moved["approach"])
        true = true_motions(cohort)
        kinds = kinds_of_trials(cohort)
        yield _sharing(moved, pd.DataFrame(sharing_rows(true, kinds)), name)
        alike = pd.DataFrame(similarity_rows(true, kinds))
        yield from (told for _, told in judged_likeness(tables["similarity"], alike, name)[:1])
        yield from _against(moved)
    yield from _lights(study, tables, cohort, found)
    yield from _methods(study, cohort, tables, found)


def window_rows(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of the part of the cycle that is told of."""
    return rows[rows["window"] == WINDOW] if len(rows) else rows


def _sharing(rows: pd.DataFrame, truth: pd.DataFrame, name: str) -> Conclusion:
    """Which joint does most, and how far shares are from the true ones where these are known."""
    own = window_rows(rows)
    own = own[own["approach"] == name].dropna(subset=["share"])
    if own.empty:
        return Conclusion("sharing", "none")
    trial = str(own["trial"].iloc[0])
    first = own[own["trial"] == trial]
    shares = first.pivot_table(index="specimen", columns="joint", values="share", observed=True)
    joint = str(shares.mean().idxmax())
    most = 100.0 * float(shares[joint].mean())
    values = {
        "share": Value(most, "%", n=len(shares), source="sharing: mean over subjects"),
        "agree": Value(int((shares.idxmax(axis="columns") == joint).sum()), source="sharing"),
        "subjects": Value(len(shares), source="sharing"),
    }
    names = {"approach": phrase(name), "joint": level(joint), "trial": plain(trial)}
    keys = ["specimen", "trial", "joint", "share"]
    known = window_rows(truth).reindex(columns=keys).dropna(subset=["share"])
    both = own.merge(known, on=keys[:3], suffixes=("", "_true"))
    if both.empty:
        return Conclusion("sharing", "untested", values, names)
    n, how = int(both["specimen"].nunique()), "sharing beside true motions: mean absolute error"
    for told, share in (("off", both["share"]), ("even", 1.0 / len(LUMBAR_JOINTS))):
        both[told] = (share - both["share_true"]).abs()
        values[told] = Value(100.0 * float(both[told].mean()), "%", n=n, source=how)
    by_subject = both.groupby("specimen", observed=True)[["off", "even"]].mean()
    p = paired_p((by_subject["off"] - by_subject["even"]).to_numpy(float))
    verdict = "tested" if p is not None and p < LEVEL else "tested_open"
    return Conclusion("sharing", verdict, values, {**names, "people": count(n, "subject")})


def judged_likeness(
    rows: pd.DataFrame | None, truth: pd.DataFrame, name: str
) -> list[tuple[str, Conclusion]]:
    """How alike subjects share each motion by an approach, beside how alike they truly do.

    Motions of three subjects or more by name, that in which the approach is furthest off first.
    Each says in how many of those with a true coefficient the approach is near it.
    """
    if rows is None or rows.empty:
        return []
    own = window_rows(rows)
    own = own[(own["approach"] == name) & (own["n_specimens"] >= FEWEST)]
    known = {
        str(row["trial"]): row["cmc"]
        for row in window_rows(truth).to_dict("records")
        if row["status"] != TOO_FEW
    }
    true = own["trial"].map(known).astype(float)
    near = (own["cmc"].astype(float) - true).abs() <= CLEARLY
    motions = {"near": near.sum(), "motions": true.notna().sum()}
    counts = {
        told: Value(int(n), source="similarity beside true motions") for told, n in motions.items()
    }
    found = []
    for row in own.to_dict("records"):
        trial, values = str(row["trial"]), {}
        for told, cmc in (("cmc", row["cmc"]), ("true", known.get(trial))):
            if pd.notna(cmc):
                source = "similarity: cmc" if told == "cmc" else "CMC of shares of true motions"
                values[told] = Value(float(cmc), n=int(row["n_specimens"]), source=source)
        nothing_varies = "cmc" not in values and "nothing varies" in str(row["message"])
        verdict, off = "differ", 0.1
        if name.startswith(CONSTRAINED):
            verdict = "fixed"
        elif trial not in known:
            verdict, off = "untested" if "cmc" in values else "untested_undefined", 0.0
            verdict = "equal" if nothing_varies else verdict
        elif "true" in values and "cmc" not in values:
            verdict, off = "equal" if nothing_varies else "undefined", 2.0
        elif "true" in values:
            over = values["cmc"].number - values["true"].number
            verdict = "alike" if abs(over) <= CLEARLY else "lower" if over < 0.0 else "higher"
            off = 0.2 + abs(over)
        names = {"approach": phrase(name), "trial": plain(trial)}
        found.append((off, trial, Conclusion("likeness", verdict, values | counts, names)))
    return [(trial, told) for _, trial, told in sorted(found, key=lambda one: -one[0])]


def _against(rows: pd.DataFrame) -> Iterator[Conclusion]:
    """Shares that say that joints turn against each other."""
    known = window_rows(rows).dropna(subset=["share"])
    if known.empty:
        return
    out = known[(known["share"] < 0.0) | (known["share"] > 1.0)]
    values = numbers_from("sharing", out=len(out), shares=len(known))
    names = {"approaches": _named(out["approach"])}
    yield Conclusion("against", "check" if len(out) else "ok", values, names)


def _named(approaches: Iterable[Any]) -> str:
    """A few approaches by name, more as a number."""
    names = sort_approaches(map(str, approaches))
    if len(names) > MOST_NAMES:
        return count(len(names), "approach", "approaches")
    return listed(map(phrase, names))


def _lights(
    study: Tracking, tables: Tables, cohort: Cohort, found: list[Ranking]
) -> Iterator[Conclusion]:
    fits, scales = tables["fits"], study.scales
    if len(fits):
        lost = fits[~fits["status"].isin(ENDED)]
        verdict = "ok" if lost.empty else "check" if len(lost) <= MANY_LOST * len(fits) else "stop"
        values = {"lost": Value(len(lost), source="fits"), "fits": Value(len(fits), source="fits")}
        yield Conclusion("fits", verdict, values, {"approaches": _named(lost["approach"])})
        yield from _beyond("markers", fits, "largest_deviation_mm", study.largest_deviation_mm)
        yield from _beyond("vibration", fits, ACCELERATION, scales.turn_deg_per_s2)
    if not found:
        who = count(len(cohort.specimen_names), "subject")
        yield Conclusion("sample", "check_untested", names={"subjects": who})
    for one in found[:1]:
        if one.lacking:
            yield Conclusion("lacking", "check", names={"approaches": _named(one.lacking)})
    yield from _recordings(study, tables)
    assumed = {"marker": scales.marker_mm, "skin": scales.skin_mm, "shared": scales.shared_skin_mm}
    values = {name: Value(size, "mm", source="settings: scales") for name, size in assumed.items()}
    yield Conclusion("assumed", "check", values)


def _beyond(rule: str, fits: pd.DataFrame, column: str, limit: float) -> Iterator[Conclusion]:
    """Whether a number of some fit is beyond a limit of the study."""
    known = fits.dropna(subset=[column])
    if known.empty:
        return
    far = known[column].astype(float) > limit
    unit, source = "°/s²" if column == ACCELERATION else "mm", f"fits: {column}"
    values = {
        "far": Value(int(far.sum()), source=source),
        "all": Value(len(known), source=source),
        "most": Value(float(known[column].max()), unit, source=source),
        "limit": Value(limit, unit, source="settings"),
    }
    names = {"approaches": _named(known.loc[far, "approach"])}
    yield Conclusion(rule, "check" if far.any() else "ok", values, names)


def _recordings(study: Tracking, tables: Tables) -> Iterator[Conclusion]:
    """Clusters, sizes of subjects and what is remarkable of recordings."""
    clusters, sizes, remarks = (tables[name] for name in ("clusters", "sizes", "remarks"))
    if len(clusters):
        known = clusters[clusters["status"] != TOO_FEW]
        loose = int((known["status"] == "not_rigid").sum())
        numbers = {"loose": loose, "known": len(known), "unseen": len(clusters) - len(known)}
        values = {name: Value(n, source="clusters: status") for name, n in numbers.items()}
        if len(known):
            most = float(known["variability_mm"].max())
            values["most"] = Value(most, "mm", source="clusters: variability_mm")
        verdict = "check_unknown" if known.empty else "check" if loose else "ok"
        yield Conclusion("clusters", verdict, values)
    if len(sizes):
        told = 100.0 * (sizes.loc[sizes["status"] == TOLD, "factor"].astype(float) - 1.0)
        ends = {"low": told.min(), "high": told.max()} if len(told) else {}
        values = {name: Value(float(x), "%", source="sizes") for name, x in ends.items()}
        unscaled = "check" if (told.abs() > UNLIKE).any() else "ok"
        verdict = unscaled if study.scaling == "none" else "ok_scaled"
        yield Conclusion("sizes", verdict if len(told) else "check_unknown", values)
    who = remarks["specimen"].nunique() if len(remarks) else 0
    values = numbers_from("remarks", remarks=len(remarks), subjects=who)
    yield Conclusion("recordings", "check" if len(remarks) else "ok", values)


def _methods(
    study: Tracking, cohort: Cohort, tables: Tables, found: list[Ranking]
) -> Iterator[Conclusion]:
    values = {
        "approaches": Value(len(study.approaches), source="settings: approaches"),
        "nodes": Value(study.intervals + 1, source="settings: intervals"),
        "ratios": Value(len(study.profiles.ratios), source="settings: profiles"),
        "tests": Value(max((one.tests for one in found), default=0), source="errors: pairs"),
    }
    who = {"subjects": count(len(cohort.specimen_names), "subject")}
    yield Conclusion("methods", "tracked", values, who)
    if found:
        verdict = "compared" if values["tests"].number else "described"
        yield Conclusion("methods_errors", verdict, values)
    if len(tables["profiles"]):
        yield Conclusion("methods_profiles", "profiled", values)
