"""A study of measured lifts: moments beside measured ones, and inputs that are wrong.

Goals were set before: with accelerations 10 N m (RMS), before lift-off 8, without accelerations 15.
Peaks are within 5 %; two inputs were chosen after a first comparison (docs/studies/tracking.md).

Catches a moment that moves away from the measured one, and a recording that is read as what it is
not.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

import lifts
import numpy as np
import pandas as pd
import pytest
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.motion.joint_tables import USUAL_SHARES
from spinepipe.motion.reading import read_motion
from spinepipe.motion.smoothing import USUAL_CUTOFF_HZ
from spinepipe.motion.standing_spine import UPRIGHT_DEG
from spinepipe.muscles.myo_sim import source_of_myo_sim
from spinepipe.muscles.pose import BEHIND_MM
from spinepipe.muscles.regressions import packaged
from spinepipe.problems import InputError
from spinepipe.studies.checks_of_recorded import recorded_problems
from spinepipe.studies.recorded_motion import recorded_motion
from spinepipe.studies.registry import every_form
from spinepipe.studies.tracking.joint_moments import table_rows
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.trunk_loads.persons import UprightPerson
from spinepipe.studies.trunk_loads.settings import TrunkLoads

STUDY = Tracking(study="lifts", kind="tracking", cohort="stoop_lift", marker_set="plug_in_gait")


@pytest.fixture(scope="module")
def agreement() -> pd.DataFrame:
    rows, beside = table_rows(STUDY, lifts.lifts())
    assert len(rows) == 17 * (181 + 196 + 200)
    assert sum(row["largest"] for row in rows) == 17 * len(lifts.TRIALS)
    return pd.DataFrame(beside)


def test_moments_are_those_that_were_measured_from_the_feet(agreement: pd.DataFrame) -> None:
    feet = agreement[agreement["method"] == "from_feet"].set_index("way")
    assert list(feet.loc["moving", "trial"]) == list(lifts.TRIALS)
    assert feet.loc["moving", "rmse_nm"].max() < 10.0
    assert feet.loc["moving", "before_nm"].max() < 8.0
    assert feet.loc["moving", "peak_percent"].abs().max() < 5.0
    assert feet.loc["still", "rmse_nm"].max() < 15.0
    assert feet.loc["still", "peak_percent"].between(-15.0, -5.0).all()
    assert feet[["right_bending_nm", "left_rotation_nm"]].max(axis=None) < 10.0


def test_hands_know_of_the_box_from_lift_off_on(agreement: pd.DataFrame) -> None:
    hands = agreement[(agreement["method"] == "from_hands") & (agreement["way"] == "moving")]
    assert (hands["after_nm"] < 10.0).all()
    assert (hands["before_nm"] > 50.0).all()  # the source takes the box to hang on them all along


def test_defaults_of_settings_are_those_of_the_library() -> None:
    assert (STUDY.cutoff_hz, STUDY.ratios) == (USUAL_CUTOFF_HZ, USUAL_SHARES)
    assert TrunkLoads.model_fields["passive"].default.joints_behind_mm == BEHIND_MM


def test_a_man_stands_as_the_search_of_trunk_loads_finds() -> None:
    settings = TrunkLoads(study="a", kind="trunk_loads", cohort="a")
    source, sizes = source_of_myo_sim().trunk, packaged()
    found = np.rad2deg(UprightPerson.of(settings, source, lifts.MAN, sizes).upright.angles)
    assert np.abs(found - UPRIGHT_DEG).mean() < 1.0


def edited(folder: Path, edit: Callable[[Path], None]) -> Cohort:
    copy = folder / "stoop_lift"
    shutil.copytree(lifts.FOLDER, copy)
    edit(copy)
    return cohorts.read(copy, every_form())


def box(change: Callable[[pd.DataFrame], None]) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        rows = pd.read_csv(folder / "box.csv")
        change(rows)
        rows.to_csv(folder / "box.csv", index=False)

    return edit


def renamed(file: str, names: dict[str, str]) -> Callable[[Path], None]:
    """The markers of a file in ground axes, some under other names."""

    def edit(folder: Path) -> None:
        read = read_motion(folder / f"{file}.c3d", "x z -y")
        columns = {"time_s": read.time_s}
        for k, name in enumerate(read.names):
            for axis, values in zip("xyz", read.places[:, k].T, strict=True):
                columns[f"{names.get(name, name)}_{axis}_m"] = values
        pd.DataFrame(columns).to_csv(folder / f"{file}_markers.csv", index=False)
        trials = pd.read_csv(folder / "trials.csv")
        own = trials["trial"] == file
        trials.loc[own, ["file", "axes"]] = [f"{file}_markers.csv", "x y z"]
        trials.to_csv(folder / "trials.csv", index=False)

    return edit


def axes(text: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        trials = pd.read_csv(folder / "trials.csv")
        trials.assign(axes=text).to_csv(folder / "trials.csv", index=False)

    return edit


def exchanged(one: str, other: str) -> dict[str, str]:
    return {one: other, other: one}


def in_metres(rows: pd.DataFrame) -> None:
    rows[["x_mm", "y_mm"]] /= 1000.0


def late(rows: pd.DataFrame) -> None:
    rows["time_s"] += 0.5


def another_day(rows: pd.DataFrame) -> None:
    rows["time_s"] += 100.0


@sweep(
    "edit, told",
    [
        (box(in_metres), "is it in m or cm, not in mm?"),
        (box(late), "box.csv -0.50 s would fit"),
        (box(another_day), "put it on the clock of the markers"),
        (renamed("stance", exchanged("LASI", "RASI")), "LASI and RASI"),
        (axes("-x z y"), "did you mean 'x z -y'?"),
        (axes("z x y"), "off upright as it begins"),
        (renamed("lift1", exchanged("C7", "STRN")), "exchange the two names"),
        (renamed("lift1", exchanged("LELB", "LWRA")), "mm in the stance"),
        (renamed("lift2", {"T10": "T11"}), "T10: found no such marker"),
        (renamed("lift2", {"RBAK": "SCAP", "LASI": "lasi", "C7": "s:C7"}), ""),
    ],
)
def test_a_recording_that_is_not_what_its_name_says_is_told(
    tmp_path: Path, edit: Callable[[Path], None], told: str
) -> None:
    found = " ".join(map(str, recorded_problems(edited(tmp_path, edit), 6.0)))
    assert told in found
    assert bool(told) == bool(found), found


def test_a_lift_without_a_stance_is_refused_with_what_to_add(tmp_path: Path) -> None:
    def edit(folder: Path) -> None:
        trials = pd.read_csv(folder / "trials.csv")
        trials[trials["kind"] != "stance"].to_csv(folder / "trials.csv", index=False)
        plates = pd.read_csv(folder / "force_plates.csv")
        plates[plates["trial"] != "stance"].to_csv(folder / "force_plates.csv", index=False)

    with pytest.raises(InputError, match="add a trial of kind stance"):
        recorded_motion(edited(tmp_path, edit), "s01", "lift1", lifts.spine())


def test_without_plates_the_height_of_the_box_tells_lift_off(tmp_path: Path) -> None:
    cohort = edited(tmp_path, lambda folder: (folder / "force_plates.csv").unlink())
    by_height = recorded_motion(cohort, "s01", "lift1", lifts.spine())
    by_plate = recorded_motion(lifts.lifts(), "s01", "lift1", lifts.spine())
    assert by_height.lift_off_s == pytest.approx(by_plate.lift_off_s, abs=0.2)


def test_what_was_not_measured_tells_nothing(tmp_path: Path) -> None:
    def edit(folder: Path) -> None:
        plates = pd.read_csv(folder / "force_plates.csv")
        plates.assign(fy_n=np.nan).to_csv(folder / "force_plates.csv", index=False)
        moments = pd.read_csv(folder / "measured_moments.csv")
        moments.loc[moments["trial"] == "lift1", "mz_nm"] = np.nan
        moments.to_csv(folder / "measured_moments.csv", index=False)

    _, beside = table_rows(STUDY, edited(tmp_path, edit))
    assert {row["trial"] for row in beside} == {"lift2", "lift3"}
