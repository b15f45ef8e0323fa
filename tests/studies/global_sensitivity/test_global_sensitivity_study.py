"""Studies of global sensitivity: defaults, spreads, and every fault located and explained."""

# ruff: noqa: E501
# One fault a line, however long: tables to look things up in.

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from cohort_cases import Change, add, both, cell, joints, line, swap, text, without, write
from scipy import stats
from sweeps import sweep

from spinepipe.problems import InputError, InputProblem
from spinepipe.sensitivity_analysis.global_indices.estimates import INDICES, IndexStatus
from spinepipe.studies import read as studies
from spinepipe.studies.global_sensitivity import factors as varied
from spinepipe.studies.global_sensitivity.sampling import spreads_of
from spinepipe.studies.global_sensitivity.settings import GlobalSensitivity
from spinepipe.studies.global_sensitivity.tables import INDICES as INDEX_TABLE

STUDY = """\
study: probe
kind: global_sensitivity
cohort: small
design: {method: sobol, samples: 64}
factors:
  - {of: stiffness, coordinate: extension, joints: [L3L4], times: {low: 0.5, high: 2.0}}
  - {of: landmark, vertebra: L3, landmark: left_pedicle_base, axis: x, offset_mm: {sd: 1.0}, group: L3_landmarks}
  - {of: landmark, vertebra: L3, landmark: right_pedicle_base, axis: z, offset_mm: {sd: 1.0}, group: L3_landmarks}
  - {of: joint_centre, joints: [L2L3], axis: anterior, offset_mm: {sd: 2.0, low: -4, high: 4}}
  - {of: joint_axes, axis: left_rotation, offset_deg: {mean: 1, sd: 2.0}}
  - {of: load_point, axis: x, offset_mm: {low: -5, high: 5}}
  - {of: load_direction, axis: z, offset_deg: {sd: 2}}
  - {of: load_size, times: {sd: 0.1}}
  - {of: mass, vertebrae: [L2], times: {mean: 1.2, sd: 0.1}}
  - {of: centre_of_mass, axis: y, offset_mm: {low: -3, high: 1}, name: height}
  - {of: damping, times: {low: 0.5, high: 2}}
"""
FILE = "config/studies/probe.yaml"
FIRST = "{of: stiffness, coordinate: extension, joints: [L3L4], times: {low: 0.5, high: 2.0}}"
SIZE = "  - {of: load_size, times: {sd: 0.1}}\n"
UNGROUPED = STUDY.replace(", group: L3_landmarks", "")


def project(root: Path, study: str = STUDY, *changes: Change) -> Path:
    """A project folder with one study and one cohort."""
    (root / "config" / "studies").mkdir(parents=True)
    (root / FILE).write_text(study)
    write(root / "config" / "cohorts" / "small", *changes)
    return root


def sound(root: Path, study: str = STUDY, *changes: Change) -> GlobalSensitivity:
    """The study, checked."""
    found, _ = studies.check(project(root, study, *changes), "probe")
    assert isinstance(found, GlobalSensitivity)
    return found


def complaints(root: Path, study: str, *changes: Change) -> tuple[InputProblem, ...]:
    """What checking the study complains about."""
    with pytest.raises(InputError) as caught:
        studies.check(project(root, study, *changes), "probe")
    return caught.value.problems


def test_names_groups_and_units(tmp_path: Path) -> None:
    study = sound(tmp_path)
    own = (
        "joint_centre_L2L3_anterior",
        "joint_axes_left_rotation",
        "load_point_x",
        "load_direction_z",
        "load_size",
        "mass_L2",
        "height",
        "damping",
        "dummy",
    )
    landmarks = ("landmark_L3_left_pedicle_base_x", "landmark_L3_right_pedicle_base_z")
    assert study.factor_names == ("stiffness_L3L4_extension", *landmarks, *own)
    assert study.groups == ("stiffness_L3L4_extension", *["L3_landmarks"] * 2, *own)
    assert study.compared == ("stiffness_L3L4_extension", "L3_landmarks", *own)
    assert study.units == (*"1", *["mm"] * 3, "deg", "mm", "deg", *"11", "mm", *"11")


def test_what_is_left_out_has_defaults(tmp_path: Path) -> None:
    short = "study: probe\nkind: global_sensitivity\ncohort: small\nfactors:\n" + SIZE
    study = sound(tmp_path, short + "  - {of: damping, times: {sd: 0.1}}\n")
    assert study.design.model_dump() == {
        "method": "sobol",
        "samples": 256,
        "second_order": True,
        "levels": 4,
        "harmonics": 4,
    }
    three = ("extension", "right_bending", "left_rotation")
    assert study.outputs.model_dump() == {"motion": three, "joint_load": three, "stiffness": False}
    assert (study.seed, study.steps, study.dummy, study.loading) == (
        2024,
        "peak",
        True,
        "equilibrium",
    )
    assert (study.bootstraps, study.confidence, study.most_failed) == (1000, 0.95, 0.2)
    # Gould 2024b, table 2, uniform: 51 N m/rad in flexion-extension
    assert study.start_stiffness.extension_nm_per_rad == 51.0


def test_the_dummy_is_last_and_can_be_left_out(tmp_path: Path) -> None:
    study = sound(tmp_path, STUDY + "dummy: false\n")
    assert "dummy" not in study.factor_names
    for of_factors in (study.changes, study.units, study.per_si, study.groups, spreads_of(study)):
        assert len(of_factors) == len(study.factor_names) == 11


def test_spreads_are_those_of_the_file(tmp_path: Path) -> None:
    """Quantiles at -1, 0 and 1 SD, and at the ends: logarithms of multipliers, offsets in SI."""
    study = sound(tmp_path)
    spread = dict(zip(study.factor_names, spreads_of(study), strict=True))
    shares = stats.norm.cdf([-1.0, 0.0, 1.0])
    ends = np.array([0.0, 0.5, 1.0])
    expected = {
        "stiffness_L3L4_extension": (ends, [0.5, 1.0, 2.0]),
        "landmark_L3_left_pedicle_base_x": (shares, [-0.001, 0.0, 0.001]),
        "joint_axes_left_rotation": (shares, np.deg2rad([-1.0, 1.0, 3.0])),
        "load_point_x": (ends, [-0.005, 0.0, 0.005]),
        "load_size": (shares, np.exp([-0.1, 0.0, 0.1])),
        "mass_L2": (shares, 1.2 * np.exp([-0.1, 0.0, 0.1])),
        "height": (ends, [-0.003, -0.001, 0.001]),
        "dummy": (ends, [0.0, 0.5, 1.0]),
    }
    for name, (at, values) in expected.items():
        np.testing.assert_allclose(spread[name].values(at), values, rtol=1e-9, atol=1e-12)
    cut = spread["joint_centre_L2L3_anterior"].values(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(cut, [-0.004, 0.0, 0.004], rtol=1e-6, atol=1e-12)


def test_changes_name_places_and_axes(tmp_path: Path) -> None:
    of = varied.Of
    assert sound(tmp_path).changes == (
        varied.FactorChange(of.STIFFNESS, ("L3L4",), 3),
        varied.FactorChange(of.LANDMARK, ("L3",), 0, "left_pedicle_base"),
        varied.FactorChange(of.LANDMARK, ("L3",), 2, "right_pedicle_base"),
        varied.FactorChange(of.JOINT_CENTRE, ("L2L3",), 0),
        varied.FactorChange(of.JOINT_AXES, (), 2),
        varied.FactorChange(of.LOAD_POINT, (), 0),
        varied.FactorChange(of.LOAD_DIRECTION, (), 2),
        varied.FactorChange(of.LOAD_SIZE),
        varied.FactorChange(of.MASS, ("L2",)),
        varied.FactorChange(of.CENTRE_OF_MASS, (), 1),
        varied.FactorChange(of.DAMPING),
        varied.FactorChange(of.NOTHING),
    )


def test_delta_is_computed_only_where_it_is_named(tmp_path: Path) -> None:
    short = UNGROUPED.replace("method: sobol", "method: latin_hypercube")
    plain = sound(tmp_path / "plain", short)
    assert plain.chosen_indices == ("S1_RBD", "PAWN", "KS_low", "KS_high")
    named = sound(tmp_path / "named", short + "indices: [delta, PAWN]\n")
    assert named.chosen_indices == ("delta", "PAWN")


@sweep(
    "more, specimens, size",
    [
        ("", 1, 1),  # 64 x (2 x 11 + 2) = 1,536 runs
        ("", 2, 256),  # 3,072 runs
        ("samples_per_target: 10\n", 2, 10),
    ],
)
def test_runs_per_target(tmp_path: Path, more: str, specimens: int, size: int) -> None:
    study = sound(tmp_path, STUDY + more)
    assert study.n_runs == 64 * 24
    assert study.batch_size(specimens) == size


@dataclass(frozen=True)
class Case:
    """A fault of the study file: one replacement in it (None: added at the end), what is said."""

    about: str
    old: str | None
    new: str
    row: int | None
    key: str | None
    says: str


# fmt: off
CASES = [
    Case("unknown kind of factor", "of: load_size", "of: load_siz", 13, "factors.7.of", "did you mean 'load_size'?"),
    Case("no kind of factor", "{of: load_size, ", "{", 13, "factors.7.of", "add `of:`"),
    Case("unknown key of a factor", "coordinate:", "coordinat:", 6, "factors.0.coordinat", "did you mean 'coordinate'?"),
    Case("missing key of a factor", "axis: z, offset_deg", "offset_deg", 12, "factors.6.axis", "the key is missing"),
    Case("key of another kind", "{of: load_size,", "{of: load_size, axis: x,", 13, "factors.7.axis", "one of name, group, of, times"),
    Case("unknown axis", "load_point, axis: x", "load_point, axis: u", 11, "factors.5.axis", "'x', 'y' or 'z'"),
    Case("axis of ground in a joint", "axis: anterior", "axis: x", 9, "factors.3.axis", "'anterior'"),
    Case("no spread", "times: {sd: 0.1}}\n  - {of: mass", "times: {}}\n  - {of: mass", 13, "factors.7.times", "one of two forms"),
    Case("half a spread", "{low: -5, high: 5}", "{low: -5}", 11, "factors.5.offset_mm", "one of two forms"),
    Case("ends the wrong way", "{low: -5, high: 5}", "{low: 5, high: -5}", 11, "factors.5.offset_mm", "low below high"),
    Case("mean outside", "low: -4, high: 4", "low: 1, high: 4", 9, "factors.3.offset_mm", "mean below high"),
    Case("SD of zero", "offset_deg: {sd: 2}", "offset_deg: {sd: 0}", 12, "factors.6.offset_deg.sd", "greater than 0"),
    Case("times zero", "times: {low: 0.5, high: 2}}", "times: {low: 0, high: 2}}", 16, "factors.10.times.low", "greater than or equal to 0.0001"),
    Case("unknown key of a spread", "{mean: 1, sd: 2.0}", "{mean: 1, std: 2.0}", 10, "factors.4.offset_deg.std", "did you mean 'sd'?"),
    Case("unknown method", "method: sobol", "method: sobel", 4, "design.method", "did you mean 'sobol'?"),
    Case("no output", None, "outputs: {motion: [], joint_load: []}", 17, "outputs", "at least one output"),
    Case("output twice", None, "outputs: {motion: [right, right]}", 17, "outputs.motion", "'right' stands there twice"),
    Case("all failed allowed", None, "most_failed: 1", 17, "most_failed", "less than 1"),
    Case("name with a space", "name: height", "name: my height", 15, "factors.9.name", "a name of A-Z, a-z, 0-9, _"),
    Case("samples no power of two", "samples: 64", "samples: 100", 4, "design.samples", "take 64 or 128"),
    Case("unknown test", None, "tests: [flexon]", 17, "tests.0", "did you mean 'flexion'?"),
    Case("unknown specimen", None, "specimens: [a, c]", 17, "specimens.1", "unknown specimen 'c'"),
    Case("unknown level", None, "level_stiffness: {L4L5: {extension_nm_per_rad: 1, right_bending_nm_per_rad: 1, left_rotation_nm_per_rad: 1}}", 17, "level_stiffness.L4L5", "unknown joint 'L4L5'"),
    Case("word for a stiffness", None, "stiffness: fited", 17, "stiffness", "did you mean 'fitted'?"),
    Case("list for a stiffness", None, "stiffness: [1]", 17, "stiffness", "write keys below it"),
    Case("unknown key of stiffness", None, "stiffness: {extensoin_nm_per_rad: 20}", 17, "stiffness.extensoin_nm_per_rad", "did you mean 'extension_nm_per_rad'?"),
    Case("stiffness of zero", None, "stiffness: {extension_nm_per_rad: 0}", 17, "stiffness.extension_nm_per_rad", "greater than or equal to 0.0001"),
    Case("levels beside fitted", None, "stiffness: fitted\nlevel_stiffness: {L3L4: {extension_nm_per_rad: 1, right_bending_nm_per_rad: 1, left_rotation_nm_per_rad: 1}}", 18, "level_stiffness", "which all joints of a specimen share"),
    Case("unknown key of a start", None, "calibration: {start: {extension: 20}}", 17, "calibration.start.extension", "did you mean 'extension_nm_per_rad'?"),
    Case("unknown joint", "joints: [L3L4]", "joints: [L3L4, L4L5]", 6, "factors.0.joints.1", "unknown joint 'L4L5'"),
    Case("unknown vertebra", "vertebra: L3, landmark: left", "vertebra: L9, landmark: left", 7, "factors.1.vertebra", "one of L4, L3, L2"),
    Case("unknown landmark", "landmark: left_pedicle_base", "landmark: left_pedicl", 7, "factors.1.landmark", "did you mean 'left_pedicle_base'?"),
    Case("unknown body", "vertebrae: [L2]", "vertebrae: [L2, L1]", 14, "factors.8.vertebrae.1", "one of L3, L2"),
    Case("body that is fixed", "vertebrae: [L2]", "vertebrae: [L4]", 14, "factors.8.vertebrae.0", "unknown moving vertebra 'L4'"),
    Case("name twice", "name: height", "name: damping", 16, "factors.10", "'damping', the name of factor 10 as well"),
    Case("name of the dummy", "name: height", "name: dummy", 15, "factors.9.name", "the factor that changes nothing"),
    Case("group named as a factor", "axis: x, offset_mm: {sd: 1.0}, group: L3_landmarks", "axis: x, offset_mm: {sd: 1.0}, group: load_size", 7, "factors.1.group", "a name that no factor has"),
    Case("group named dummy", "axis: x, offset_mm: {sd: 1.0}, group: L3_landmarks", "axis: x, offset_mm: {sd: 1.0}, group: dummy", 7, "factors.1.group", "rename the group"),
    Case("groups of a hypercube", "method: sobol", "method: latin_hypercube", 7, "factors.1.group", "method one of sobol, morris"),
    Case("groups of fast", "method: sobol, samples: 64", "method: fast, samples: 65", 8, "factors.2.group", "method one of sobol, morris"),
    Case("few samples of fast", "method: sobol", "method: fast", 4, "design.samples", "at least 705 with method fast, 4 harmonics and 12 factors"),
    Case("odd levels of morris", "method: sobol, samples: 64", "method: morris, samples: 30, levels: 5", 4, "design.levels", "an even number"),
    Case("index of another method", None, "indices: [S1, PAWN]\n", 17, "indices.1", "with method sobol: one of S1, ST, S2"),
]
# fmt: on


@sweep("case", CASES, title=lambda case: case.about)
def test_fault_of_the_study_is_located_and_explained(case: Case, tmp_path: Path) -> None:
    assert case.old is None or case.old in STUDY
    study = STUDY + case.new + "\n" if case.old is None else STUDY.replace(case.old, case.new, 1)
    problems = complaints(tmp_path, study)
    here = [p for p in problems if (p.file, p.row, p.column) == (FILE, case.row, case.key)]
    assert any(case.says in str(problem) for problem in here), "\n".join(map(str, problems))


def test_several_faults_are_told_at_once(tmp_path: Path) -> None:
    wrong = STUDY.replace("samples: 64", "samples: 63").replace("[L3L4]", "[L3L5]")
    problems = complaints(tmp_path, wrong.replace("vertebrae: [L2]", "vertebrae: [L1]"))
    assert [p.column for p in problems] == [
        "design.samples",
        "factors.0.joints.0",
        "factors.8.vertebrae.0",
    ]


def only(*factors: str) -> str:
    """A study of these factors."""
    rows = "".join(f"  - {factor}\n" for factor in factors)
    return STUDY[: STUDY.index("factors:")] + "factors:\n" + rows


LANDMARK = "{of: landmark, vertebra: L3, landmark: left_pedicle_base, axis: x, offset_mm: {sd: 1}}"
POINT = "{of: load_point, axis: x, offset_mm: {sd: 1}}"
NO_FORCE = both(swap("loads.csv", "-50", "0"), swap("loads.csv", "-100", "0"))
NO_LOAD = both(NO_FORCE, swap("loads.csv", ",-1,15", ",0,15"), swap("loads.csv", ",-2,15", ",0,15"))
WEIGHTLESS = swap("cohort.yaml", "gravity: true", "gravity: false")
ONE_JOINT = text("joints.csv", "\n".join(joints().splitlines()[:2]) + "\n")
SPARE = add("landmarks.csv", "a,L3,spinous_process,-50,15,0,1\nb,L3,spinous_process,-50,15,0,1")

# fmt: off
COHORT_CASES = [
    ("landmarks where there are none", LANDMARK, [without("landmarks.csv"), text("joints.csv", joints())], "factors.1", "no landmarks.csv"),
    ("all poses given", LANDMARK, [text("joints.csv", joints())], "factors.1", "no joint frame of a, b hangs"),
    ("landmark of no frame", LANDMARK.replace("left_pedicle_base", "spinous_process"), [SPARE], "factors.1.landmark", "in no joint frame"),
    ("landmark of one specimen only", LANDMARK.replace("L3", "L4"), [line("landmarks.csv", 16, None)], "factors.1.landmark", "does not have of b"),
    ("no bodies", "{of: mass, times: {sd: 0.1}}", [without("bodies.csv"), WEIGHTLESS], "factors.1", "no bodies.csv"),
    ("body of one specimen missing", "{of: mass, times: {sd: 0.1}}", [WEIGHTLESS, line("bodies.csv", 4, None)], "factors.1.vertebrae", "for L3 of b"),
    ("no weight", "{of: centre_of_mass, axis: x, offset_mm: {sd: 1}}", [WEIGHTLESS], "factors.1", "it would do nothing"),
    ("point of a moment", POINT, [NO_FORCE], "factors.1", "no force acts in any chosen test: it would do nothing"),
    ("direction of nothing", "{of: load_direction, axis: x, offset_deg: {sd: 1}}", [NO_LOAD], "factors.1", "no load acts"),
]
# fmt: on


@sweep("about, factor, changes, key, says", COHORT_CASES)
def test_factor_that_the_cohort_does_not_serve(
    about: str, factor: str, changes: list[Change], key: str, says: str, tmp_path: Path
) -> None:
    problems = complaints(tmp_path, only(FIRST, factor), *changes)
    assert any(p.column == key and says in str(p) for p in problems), (about, *map(str, problems))
    assert {p.column for p in problems} <= {key, "factors.1"}


def test_factors_that_do_something_are_taken(tmp_path: Path) -> None:
    """A landmark of one joint whose pose is not given; moments have a direction."""
    turned = "{of: load_direction, axis: x, offset_deg: {sd: 1}}"
    sound(tmp_path / "moments", only(FIRST, turned), NO_FORCE)
    sound(tmp_path / "landmark", only(FIRST, LANDMARK), ONE_JOINT)


def test_endplates_of_a_given_joint_may_make_the_next_one(tmp_path: Path) -> None:
    """L3L4 of specimen a is given; L3's superior endplate faces L2L3, L4's faces nothing."""
    upper = LANDMARK.replace("left_pedicle_base", "superior_endplate_centre")
    sound(tmp_path / "upper", only(FIRST, upper), ONE_JOINT)
    (problem,) = complaints(tmp_path / "lower", only(FIRST, upper.replace("L3", "L4")), ONE_JOINT)
    assert "no joint frame of a hangs" in problem.found


@sweep("rows", [(FIRST,), (), (LANDMARK[:-1] + ", group: g}",) * 2])
def test_one_factor_has_nothing_to_be_compared_with(rows: tuple[str, ...], tmp_path: Path) -> None:
    rows = tuple(row.replace("axis: x", f"axis: {axis}") for row, axis in zip(rows, "xy"))  # noqa: B905
    text = only(*rows) if rows else only().replace("factors:", "factors: []")
    (problem,) = complaints(tmp_path, text)
    assert (problem.column, "at least 2 factors" in problem.allowed) == ("factors", True)


def test_a_cohort_needs_loads(tmp_path: Path) -> None:
    cohort = both(without("loads.csv"), without("motion.csv"))
    (problem,) = complaints(tmp_path, only(FIRST, SIZE.strip().removeprefix("- ")), cohort)
    assert (problem.column, "no loads.csv" in problem.found) == ("cohort", True)


def test_a_specimen_without_a_load_in_the_chosen_tests(tmp_path: Path) -> None:
    """The test is of specimen a alone."""
    changes = [cell("loads.csv", n, "specimen", "a") for n in (2, 3, 4)]
    unread = [line("motion.csv", n, None) for n in range(13, 7, -1)]
    study = only(FIRST, POINT)
    (problem,) = complaints(tmp_path / "both", study, *changes, *unread)
    assert (problem.column, "specimen 'b'" in problem.found) == ("tests", True)
    sound(tmp_path / "one", study + "specimens: [a]\n", *changes, *unread)


def test_fitted_stiffness_needs_motion(tmp_path: Path) -> None:
    study = only(FIRST, POINT) + "stiffness: fitted\n"
    (problem,) = complaints(tmp_path, study, without("motion.csv"))
    assert (problem.row, problem.column) == (8, "stiffness")
    assert "give `stiffness` as a mapping" in str(problem)
    other = sound(tmp_path / "with", study)
    assert other.is_fitted
    assert other.start_stiffness.in_order()[3] == 51.0
    given = sound(tmp_path / "given", only(FIRST, POINT) + "stiffness: {extension_nm_per_rad: 20}")
    assert not given.is_fitted
    assert given.start_stiffness.in_order()[3] == 20.0


def test_calibrated_stiffness_needs_motion(tmp_path: Path) -> None:
    study = only(FIRST, POINT) + "outputs: {stiffness: true}\n"
    (problem,) = complaints(tmp_path / "none", study, without("motion.csv"))
    assert (problem.row, problem.column) == (8, "outputs.stiffness")
    unread = [line("motion.csv", n, None) for n in range(13, 7, -1)]
    (problem,) = complaints(tmp_path / "b", study, *unread)
    assert "no motion of b" in problem.found
    weights = "calibration: {weights: {right: 1, anterior: 0, superior: 0, extension: 0}}\n"
    (problem,) = complaints(tmp_path / "unseen", study + weights)
    assert problem.column == "calibration.weights"
    assert "one of anterior_mm, superior_mm, extension_deg" in problem.allowed
    sound(tmp_path / "sound", study)


def test_methods_without_groups_take_factors_alone(tmp_path: Path) -> None:
    for method in ("latin_hypercube", "fast", "morris"):
        design = f"design: {{method: {method}, samples: 800}}\n"
        study = UNGROUPED.replace("design: {method: sobol, samples: 64}\n", design)
        assert sound(tmp_path / method, study).design.method == method


def test_tables_know_every_index_and_every_end_of_an_analysis() -> None:
    index = INDEX_TABLE.column("index")
    assert set(index.allowed) == {name for names in INDICES.values() for name in names}
    assert tuple(one.partition(": ")[0] for one in index.meaning.split("; ")) == index.allowed
    assert set(INDEX_TABLE.column("status").allowed) == set(IndexStatus)
