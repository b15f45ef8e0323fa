"""``supports.csv``: what a rig fixes, as the engine gets it, as it is read, and what is refused.

Catches a rig's fixed coordinates that reach the engine wrongly or are left out unsaid.
"""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohort_cases import Change, Files, both, swap, text, write
from hypothesis import given
from hypothesis import strategies as st
from sweeps import sweep

from spinepipe import cohort as cohorts
from spinepipe import problems
from spinepipe.cohort import Cohort, checks
from spinepipe.cohort.measured import MeasuredCycle, measured_specimen
from spinepipe.cohort.supports import STATES, Rig, motion_read
from spinepipe.problems import InputError, InputProblem
from spinepipe.studies.places import readings
from spinepipe.units import COORDINATES

HEADER = "specimen,test,joint,coordinate,state,reaction\n"
NO_FACTOR = None
EXTENSION, ANTERIOR = 3, 0


def rig(*rows: str, header: str = HEADER) -> Change:
    return text("supports.csv", header + "".join(f"{row}\n" for row in rows))


def read(folder: Path, *changes: Change) -> Cohort:
    return cohorts.read(write(folder / "small", *changes))


def flexion(cohort: Cohort, specimen: str = "a") -> MeasuredCycle:
    return measured_specimen(cohort, specimen, ["flexion"]).tested[0]


def refused(folder: Path, *changes: Change) -> tuple[InputProblem, ...]:
    with pytest.raises(InputError) as caught:
        read(folder, *changes)
    return caught.value.problems


def load_sds(files: Files) -> None:
    yaml = files["cohort.yaml"]
    assert isinstance(yaml, str)
    files["cohort.yaml"] = yaml + "  force_n: 2.0\n  moment_nm: 0.5\n"


def test_a_held_coordinate_is_an_input_at_zero(tmp_path: Path) -> None:
    one = flexion(read(tmp_path, rig("*,*,*,extension,held,")))
    for step in one.case.steps:
        assert [(s.joint, s.coordinate, s.value) for s in step.supports] == [
            (0, EXTENSION, 0.0),
            (1, EXTENSION, 0.0),
        ]
        assert {s.read_as for s in step.supports} == {NO_FACTOR}
    assert np.isnan(one.measured[..., EXTENSION]).all()
    assert np.isfinite(one.measured[..., ANTERIOR]).all()


def test_a_prescribed_coordinate_goes_where_motion_says(tmp_path: Path) -> None:
    one = flexion(read(tmp_path, rig("a,flexion,L2L3,extension,prescribed,")))
    values = [step.supports[0].value for step in one.case.steps]
    np.testing.assert_allclose(values, np.deg2rad([0.0, -1.0, -2.0]))
    assert one.case.fixed == [6 + EXTENSION]
    assert np.isnan(one.measured[:, 1, EXTENSION]).all()
    assert np.isfinite(one.measured[:, 0, EXTENSION]).all()


def test_of_rows_that_fit_the_last_counts(tmp_path: Path) -> None:
    cohort = read(tmp_path, rig("*,*,*,extension,held,", "a,flexion,L3L4,extension,free,"))
    assert flexion(cohort, "a").case.fixed == [6 + EXTENSION]
    assert flexion(cohort, "b").case.fixed == [EXTENSION, 6 + EXTENSION]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["*", "a", "b"]),
            st.sampled_from(["*", "flexion", "bending"]),
            st.sampled_from(["*", "L3L4", "L2L3", "L9L9", None]),
            st.sampled_from(["extension", "anterior", "bad", None]),
            st.sampled_from([*STATES, "bad", None]),
            st.sampled_from(["measured", "unknown", None]),
        ),
        max_size=12,
    )
)
def test_a_rig_looked_up_is_the_rig_read_row_by_row(rows) -> None:
    names = ["specimen", "test", "joint", "coordinate", "state", "reaction"]
    table, joints = pd.DataFrame(rows, columns=names, dtype="object"), ("L3L4", "L2L3")
    index = Rig(table, joints)
    for specimen, test in product("ab", ("flexion", "bending")):
        found: dict[tuple[int, int], tuple[str, bool]] = {}
        for who, what, joint, coordinate, state, reaction in rows:
            fits = who in ("*", specimen) and what in ("*", test)
            if fits and coordinate in COORDINATES and state in STATES:
                for number, name in enumerate(joints):
                    if joint in ("*", name):
                        place = number, COORDINATES.index(coordinate)
                        found[place] = state, reaction == "measured"
        wanted = [(*place, *found[place]) for place in sorted(found) if found[place][0] != "free"]
        assert [tuple(one) for one in index.fixed(specimen, test)] == wanted


def test_a_table_of_many_rows_is_gone_through_once(tmp_path, monkeypatch) -> None:
    """Else 150,000 tests times 150,000 rows of a rig hold a check up for good."""
    made = []
    monkeypatch.setattr(checks, "Rig", lambda *given: made.append(given) or Rig(*given))
    read(tmp_path, rig("*,*,*,extension,held,"))
    assert not made
    read(tmp_path / "prescribed", rig("*,*,*,extension,prescribed,"))
    assert len(made) == 1


def test_faults_of_a_rig_are_bounded(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(problems, "MOST_MADE", 50)
    found = refused(tmp_path, rig(*(f"*,q{n},L2L3,extension,hold{n}," for n in range(400))))
    assert 2 <= sum(1 + one.others for one in found) <= 2 * 51


def test_a_measured_load_is_read_as_no_reaction(tmp_path: Path) -> None:
    """One SD of the load, 0.5 N m, counts as one SD of the angle, 0.1 deg."""
    cohort = read(tmp_path, load_sds, rig("*,*,L2L3,extension,prescribed,measured"))
    one = flexion(cohort)
    (support,) = one.case.steps[0].supports
    assert support.read_as == pytest.approx(np.deg2rad(0.1) / 0.5, rel=1e-12)
    assert (one.measured[:, 1, EXTENSION] == 0.0).all()


def test_what_is_no_reading_is_not_counted_as_one(tmp_path: Path) -> None:
    cohort = read(tmp_path, rig("*,*,*,extension,held,"))
    assert motion_read(cohort)["extension_deg"].isna().all()
    assert readings(cohort, None, ["extension"]).empty
    assert not readings(cohort, None, ["anterior"]).empty


def test_digests_without_a_rig_are_as_before_and_with_one_are_others(tmp_path: Path) -> None:
    plain, held = read(tmp_path / "1"), read(tmp_path / "2", rig("a,*,*,extension,held,"))
    assert plain.digest != held.digest
    assert plain.digest_of(["a"]) != held.digest_of(["a"])
    everyone = read(tmp_path / "3", rig("*,*,*,extension,held,"))
    assert plain.digest_of(["b"]) != everyone.digest_of(["b"])


@sweep(
    "row, column, told",
    [
        ("*,*,L2L3,flexion,held,", "coordinate", "one of anterior"),
        ("*,*,L2L3,extension,hold,", "state", "did you mean 'held'"),
        ("*,*,L2L3,extension,held,yes", "reaction", "one of unknown, measured"),
        ("*,*,L2L3,,held,", "coordinate", "name the coordinate"),
        ("*,*,,extension,held,", "joint", "name the joint"),
        ("*,*,L4L5,extension,held,", "joint", "unknown joint"),
        ("c,*,L2L3,extension,held,", "specimen", "unknown specimen"),
        ("*,flexon,L2L3,extension,held,", "test", "did you mean 'flexion'"),
        ("*,*,L2L3,extension,held,measured", "reaction", "measurement_sd.moment_nm"),
        ("*,*,L2L3,right,held,measured", "reaction", "measurement_sd.force_n"),
    ],
)
def test_a_bad_row_is_told_with_its_place(row: str, column: str, told: str, tmp_path: Path) -> None:
    (problem,) = refused(tmp_path, rig(row))
    assert (problem.file, problem.row, problem.column) == ("small/supports.csv", 2, column)
    assert told in str(problem)


def test_a_vertebra_in_a_direction_is_refused_in_words(tmp_path: Path) -> None:
    header = "specimen,test,joint,coordinate,vertebra,direction,state\n"
    (problem,) = refused(tmp_path, rig("*,*,,,L2,x,held", header=header))
    assert "not yet supported" in str(problem)
    assert problem.row == 2


def test_the_same_place_twice_is_refused(tmp_path: Path) -> None:
    row = "a,flexion,L2L3,extension,held,"
    (problem,) = refused(tmp_path, rig(row, row))
    assert "again a, flexion, L2L3, extension" in str(problem)


def test_what_is_prescribed_needs_a_value_at_each_step(tmp_path: Path) -> None:
    """Said once per coordinate, whatever the number of steps; all problems at once."""
    problems = refused(
        tmp_path,
        both(
            rig("a,*,L2L3,right_bending,prescribed,", "a,*,L2L3,extension,prescribed,"),
            swap("motion.csv", "a,flexion,1,L2L3,-1,", "a,flexion,1,L2L3,,"),
        ),
    )
    told = [str(problem) for problem in problems]
    assert len(told) == 2
    assert any("no right_bending_deg of L2L3 at step 0" in one for one in told)
    assert any("no extension_deg of L2L3 at step 1" in one for one in told)


def test_a_rig_needs_no_word_where_nothing_is_known_of_it(tmp_path: Path) -> None:
    plain = read(tmp_path)
    assert plain.supports is None
    assert flexion(plain).case.fixed == []
    assert motion_read(plain) is plain.motion


def test_an_empty_cell_of_a_word_is_told(tmp_path: Path) -> None:
    problems = refused(tmp_path, rig("*,*,L2L3,extension,,"))
    assert [p.column for p in problems] == ["state"]


def test_line_numbers_are_those_of_the_file(tmp_path: Path) -> None:
    good = "*,*,L3L4,extension,held,"
    (problem,) = refused(tmp_path, rig(good, "*,*,L2L3,extension,hold,"))
    assert problem.row == 3


PRELOAD = "specimen,test,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm\n"


def preload(*rows: str) -> Change:
    return text("preload.csv", PRELOAD + "".join(f"{row}\n" for row in rows))


def test_a_preload_acts_at_every_step(tmp_path: Path) -> None:
    """As if its wrench had been written into every step of loads.csv, step 0 too."""
    cohort = read(tmp_path, preload("*,*,L2,0,-400,0,0,0,0,5,72,0", "a,flexion,L3,0,0,0,0,1,0,,,"))
    plain = flexion(read(tmp_path / "plain"))
    for specimen, count in (("a", 2), ("b", 1)):
        one = flexion(cohort, specimen)
        for step, bare in zip(one.case.steps, plain.case.steps, strict=True):
            assert len(step.wrenches) == len(bare.wrenches) + count
            axial = step.wrenches[len(bare.wrenches)]
            assert (axial.body, axial.force.tolist()) == (1, [0.0, -400.0, 0.0])
            np.testing.assert_allclose(axial.point, [0.005, 0.072, 0.0])


@sweep(
    "row, column, told",
    [
        ("*,*,L4,0,-400,0,0,0,0,0,0,0", "vertebra", "fixed to ground"),
        ("*,*,L2,0,-400,0,0,0,0,,,", "px_mm", "a force without a point"),
        ("*,*,L2,0,-400,0,0,0,0,1,,", "py_mm", "an incomplete point"),
        ("*,flexon,L2,0,-400,0,0,0,0,0,0,0", "test", "did you mean 'flexion'"),
        ("c,*,L2,0,-400,0,0,0,0,0,0,0", "specimen", "unknown specimen"),
    ],
)
def test_a_bad_preload_is_told_with_its_place(
    row: str, column: str, told: str, tmp_path: Path
) -> None:
    (problem,) = refused(tmp_path, preload(row))
    assert (problem.file, problem.row, problem.column) == ("small/preload.csv", 2, column)
    assert told in str(problem)
