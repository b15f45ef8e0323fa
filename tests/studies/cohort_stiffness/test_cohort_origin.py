"""Every table of a cohort study carries its digests, those joined of jobs' files too."""

from pathlib import Path

import pytest
from chain_cases import STUDY, Chains
from cohort_edge_cases import A

from spinepipe.jobs.collect import join_files
from spinepipe.marks import KEY
from spinepipe.studies.cohort_stiffness import fit, literature, pool
from spinepipe.studies.cohort_stiffness.kind import KIND
from spinepipe.tables import metadata_of, read

DIGESTS = {"code_digest", "config_digest", "data_digest", KEY}


def placed(folder: Path, place: str, *names: str) -> dict[str, str]:
    """Files of a job as its rule places them; the folders become columns when they are joined."""
    files = {name: folder / name / place / f"{name}.parquet" for name in names}
    for file in files.values():
        file.parent.mkdir(parents=True)
    return {name: str(file) for name, file in files.items()}


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    """Files of the literature and of fits of two specimens, and of the pool of both."""
    root = tmp_path_factory.mktemp("chains")
    Chains({"a": A, "b": A}, ["flexion"], noise_deg=0.1).write(root)
    made = []
    for specimen in "ab":
        named = f"specimen-{specimen}"
        told = placed(root / "literature", named, "stiffness", "errors", "sign_checks")
        literature.run(str(root), STUDY, specimen, **told)
        place = f"{named}/representation-per_joint/fitted_to-flexion"
        own = placed(root / "own", place, "stiffness", "fits", "errors", "nuisances")
        fit.run(str(root), STUDY, specimen, "per_joint", "flexion", **own)
        made += [told, own]
    place = "representation-partially_pooled/fitted_to-flexion/without-nobody"
    whole = placed(root / "pool", place, "stiffness", "fits", "errors", "pooling")
    pool.run(str(root), STUDY, "partially_pooled", "flexion", "nobody", **whole)
    return [*made, whole]


@pytest.mark.parametrize("table", ["stiffness", "errors", "fits"])
def test_tables_that_are_joined_carry_all_digests(
    parts: list[dict[str, str]], table: str, tmp_path: Path
) -> None:
    """Of the jobs one reads a specimen, another the cohort: what was read has one name in all."""
    files = [part[table] for part in parts if table in part]
    marks = {file: metadata_of(read(file))[KEY] for file in files}
    output = tmp_path / f"{table}.parquet"
    join_files(KIND.table(table), marks, str(output))
    told = metadata_of(read(output))
    assert set(told) >= DIGESTS
    assert all(len(told[name]) == 64 for name in DIGESTS)
    assert all(set(metadata_of(read(file))) >= DIGESTS for file in files)


def test_what_was_read_is_the_same_digest_for_the_same_specimen(
    parts: list[dict[str, str]],
) -> None:
    told = [metadata_of(read(part["stiffness"])) for part in parts]
    literature_a, own_a, literature_b, _, whole = (one["data_digest"] for one in told)
    assert literature_a == own_a != literature_b
    assert whole == told[-1]["cohort_digest"]
