"""Job: one patient in one model, personalised and held where every film has the top."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import Status, joined
from spinepipe.studies.scoliosis.curve_angles import region
from spinepipe.studies.scoliosis.film_fit import FilmFit, NoFit
from spinepipe.studies.scoliosis.film_regions import regions
from spinepipe.studies.scoliosis.films import ERECT, LEFT, RIGHT
from spinepipe.studies.scoliosis.fixed_end_spine import SpinePose
from spinepipe.studies.scoliosis.personal import POSED, WAYS, Patient, PersonalModel, patient_of
from spinepipe.studies.scoliosis.population import population_of
from spinepipe.studies.scoliosis.pulled import AbsoluteStiffness, stiffness_by_pulls
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import (
    ABSOLUTE_STIFFNESS,
    CURVES,
    DISPLACEMENTS,
    LAWS,
    POSITIONS,
)
from spinepipe.studies.scoliosis.tangent_laws import ends_of
from spinepipe.tables import from_rows, read_frame, write
from spinepipe.units import DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

NOT_ARRIVED = "the fit to the films did not settle"
AT_BOUND = "the fit to the films ended at a bound of what may be"
UNSETTLED = "the population did not stand still within its rounds"

REGION = ("films_low", "films_high", "open_below", "open_above")
"""Columns of what films say of a ratio."""

ABSOLUTE = (
    *("at_rest_nm_per_deg", "low", "high"),
    *("mean_nm_per_deg", "mean_low", "mean_high"),
)
"""Columns of what known pulls tell."""

PUSHES = ("push_right_n", "push_up_n", "push_right_bending_nm", "push_extension_nm")


def run(
    root: str,
    study: str,
    specimen: str,
    model: str,
    laws: str,
    positions: str,
    displacements: str,
    curves: str,
    absolute_stiffness: str,
    population: list[str],
) -> None:
    """Write the rows of a patient and a model; a model of a population reads that of all."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    learned = [read_frame(path) for path in population]
    rows = rows_of(settings, cohort, specimen, model, *learned)
    marks = [mark_of(path) for path in population]
    made_by = provenance("personalise", settings, cohort, [specimen], marks)
    places = zip(
        (LAWS, POSITIONS, DISPLACEMENTS, CURVES, ABSOLUTE_STIFFNESS),
        (laws, positions, displacements, curves, absolute_stiffness),
        strict=True,
    )
    for table, path in places:
        write(from_rows(table, rows[table.name]), path, made_by)


def rows_of(
    settings: Scoliosis,
    cohort: Cohort,
    specimen: str,
    model: str,
    population: pd.DataFrame | None = None,
) -> dict[str, list[Row]]:
    """Rows of each table, by its name."""
    patient = patient_of(settings, cohort, specimen)
    personal, message, known_pulls = _personal(settings, patient, model, population)
    spine = patient.fixed_end(personal.model)
    known: Row = {"specimen": specimen, "model": model}
    taken: Row = {
        "free_parameters": personal.free,
        "decided_parameters": personal.decided,
        "scale_from": settings.scale.of,
    }
    fitting: Row = {
        "fit_status": personal.fitting and personal.fitting.status.value,
        "n_optima": personal.fitting and personal.fitting.n_optima,
    }
    found: dict[str, list[Row]] = {
        LAWS.name: [known | row | taken | fitting for row in _laws(patient, personal)],
        POSITIONS.name: [],
        DISPLACEMENTS.name: [],
        CURVES.name: [],
        ABSOLUTE_STIFFNESS.name: [known | row for row in _absolute(patient, known_pulls)],
    }
    for position in patient.read.films:
        if position == ERECT:
            continue
        posed = spine.at(patient.read.films[position].top)
        where = known | {"position": position, "fitted": position in (RIGHT, LEFT)}
        ended: Row = {"status": posed.result.status.value}
        found[POSITIONS.name].append(
            where
            | _position(patient, position, posed)
            | taken
            | ended
            | {"message": joined(message, posed.result.message)}
        )
        for table, rows in (
            (DISPLACEMENTS, _displacements(settings, patient, position, posed)),
            (CURVES, _curves(patient, position, posed)),
        ):
            found[table.name] += [where | row | ended for row in rows]
    return found


def _personal(
    settings: Scoliosis, patient: Patient, model: str, population: pd.DataFrame | None
) -> tuple[PersonalModel, str, AbsoluteStiffness | str]:
    """The model, what is to be said of how it was come by, and what known pulls tell of it."""
    if population is None:
        personal = WAYS[model](patient, settings)
        return personal, _of_fit(personal), ""
    everyone, sd = population_of(population)
    everyone = everyone.of_part(patient.read.lowest, patient.chain.n_joints)
    fit = FilmFit(patient, sd)
    try:
        fitted = fit.fit(everyone)
    except NoFit as why:
        told = f"not fitted: {why}; stiffness is that of the population"
        return fit.unfitted(everyone), told, ""
    personal = fit.personal(fitted)
    unsettled = UNSETTLED if (population["status"] == Status.NOT_CONVERGED.value).any() else ""
    if settings.film_regions:
        personal = replace(personal, by_films=regions(fit, everyone, fitted))
    absolute: AbsoluteStiffness | str = ""
    if np.isfinite(list(patient.read.traction.values())).any():
        depth = settings.profile.endplate_depth_mm
        absolute = stiffness_by_pulls(patient, fit, fitted.known, depth)
    return personal, joined(unsettled, _of_fit(personal)), absolute


def _absolute(patient: Patient, found: AbsoluteStiffness | str) -> Iterator[Row]:
    """Rows of a patient with films under known pulls; of others none."""
    for number, joint in enumerate(patient.chain.joints if found else ()):
        row: Row = {"joint": joint, "films": "", "message": found}
        if isinstance(found, AbsoluteStiffness):
            ends = (*found.joints[:, number], *found.mean)
            row |= dict(zip(ABSOLUTE, map(float, ends), strict=True))
            row |= {"films": ", ".join(found.films), "message": ""}
        yield dict.fromkeys(ABSOLUTE) | row


def _of_fit(personal: PersonalModel) -> str:
    """What is to be said of a fit to the films."""
    if personal.fitting is None:
        return ""
    status, n_optima = personal.fitting
    told = {Status.NOT_CONVERGED: NOT_ARRIVED, Status.CONVERGED_AT_BOUND: AT_BOUND}.get(status, "")
    several = f"{n_optima} optima: the answer depends on the start" if n_optima > 1 else ""
    return joined(told, several)


def _laws(patient: Patient, personal: PersonalModel) -> Iterator[Row]:
    ends, reach = personal.ends, personal.ratio_range
    for number, joint in enumerate(patient.chain.joints):
        # how far the films let the segment's ratio go, where they were asked
        by_films: Row = dict.fromkeys((*REGION, "identifiable"))
        if personal.by_films is not None:
            region_ends = personal.by_films[number]
            open_ends = region_ends.open_below, region_ends.open_above
            cells = (region_ends.low, region_ends.high, *open_ends)
            by_films = dict(zip(REGION, cells, strict=True)) | {"identifiable": not any(open_ends)}
        yield {
            "joint": joint,
            "at_rest_nm_per_rad": float(personal.at_rest[number]),
            "ratio": float(personal.ratio[number]),
            "ratio_low": None if reach is None else float(reach[0, number]),
            "ratio_high": None if reach is None else float(reach[1, number]),
            **by_films,
            "lower_end_deg": None if ends is None else DEG_PER_RAD * float(ends.lower[number]),
            "upper_end_deg": None if ends is None else DEG_PER_RAD * float(ends.upper[number]),
            "opposite": bool(patient.pairs.opposite[number]),
            "constrained": bool(personal.constrained[number]),
        }


def _position(patient: Patient, position: str, posed: SpinePose) -> Row:
    missed = posed.result.missed
    there = posed.result.status in POSED
    pushes = dict(zip(PUSHES, posed.result.pushes.tolist(), strict=False)) if there else {}
    return {
        "missed_mm": MM_PER_M * float(np.hypot(*missed[:2])),
        "missed_deg": DEG_PER_RAD * abs(float(missed[2])),
        "chord_ratio": patient.read.chord(position),
        "film_scale": patient.read.scales[position],
        **patient.errors(position, posed),
        **{name: pushes.get(name) for name in PUSHES},
    }


def _displacements(
    settings: Scoliosis, patient: Patient, position: str, posed: SpinePose
) -> Iterator[Row]:
    ends, film = ends_of(patient.pairs, settings.enlargement), patient.read.films[position]
    off = MM_PER_M * np.stack([posed.film.right - film.right, posed.film.up - film.up], axis=1)[1:]
    read, turns = patient.read.compared(position)[1:], patient.read.compared_turns(position)
    measured, there = patient.read.turned(position), posed.result.status in POSED
    sides = np.where(measured > 0.0, ends.upper, -ends.lower)
    for number, joint in enumerate(patient.chain.joints):
        yield {
            "joint": joint,
            "measured_deg": DEG_PER_RAD * float(measured[number]) if turns[number] else None,
            "simulated_deg": DEG_PER_RAD * float(posed.r[number]) if there else None,
            "off_right_mm": float(off[number, 0]) if there and read[number] else None,
            "off_up_mm": float(off[number, 1]) if there and read[number] else None,
            "share_of_range": abs(float(measured[number])) / float(sides[number]),
            "opposite": bool(patient.pairs.opposite[number]),
        }


def _curves(patient: Patient, position: str, posed: SpinePose) -> Iterator[Row]:
    film, there = patient.read.films[position], posed.result.status in POSED
    read, vertebrae = patient.read.compared(position), patient.read.vertebrae
    for number, curve in enumerate(patient.curves):
        ends, points = curve.read(read)
        simulated = {
            "cobb_simulated_deg": DEG_PER_RAD * curve.cobb(posed.film) if there else None,
            "ferguson_simulated_deg": DEG_PER_RAD * curve.ferguson(posed.film) if there else None,
        }
        yield {
            "curve": number,
            "region": region(vertebrae[curve.apex]),
            "side": "right" if curve.side > 0 else "left",
            "lower_vertebra": vertebrae[curve.lower],
            "apex_vertebra": vertebrae[curve.apex],
            "upper_vertebra": vertebrae[curve.upper],
            "cobb_measured_deg": DEG_PER_RAD * curve.cobb(film) if ends else None,
            "ferguson_measured_deg": DEG_PER_RAD * curve.ferguson(film) if points else None,
            **simulated,
        }
