"""Representations of stiffness: one registry, of which all else follows.

Seen here: a representation that settings, tables or documentation do not know, or code that takes
one by its name.
"""

import re
from pathlib import Path
from typing import get_args

from spinepipe.studies.cohort_stiffness.claims_of_errors import CONTESTS
from spinepipe.studies.cohort_stiffness.representations import (
    EVERY,
    FITTED,
    NAMES,
    NUISANCE,
    POOLED,
    PUBLISHED,
    UNLESS_ASKED,
    named,
    start_of,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import HELICAL_AXES, NUISANCES, POOLING, STIFFNESS

ROOT = Path(__file__).resolve().parents[3]
KIND = ROOT / "spinepipe" / "studies" / "cohort_stiffness"
OF_THE_PAPER = ("claims_of_errors.py", "claims_of_stiffness.py", "significance.py")
"""Files that name the representations of which Gould et al. 2024b claim something."""


def test_settings_and_tables_allow_what_is_registered() -> None:
    (item, _) = get_args(CohortStiffness.model_fields["representations"].annotation)
    assert get_args(item) == FITTED
    assert CohortStiffness.model_fields["representations"].default == UNLESS_ASKED
    columns = (
        (STIFFNESS, NAMES),
        (HELICAL_AXES, ("", *NAMES)),
        (POOLING, POOLED),
        (NUISANCES, NUISANCE),
    )
    for table, names in columns:
        assert table.column("representation").allowed == names
    about = STIFFNESS.column("representation").meaning
    assert [one.partition(": ")[0] for one in about.split("; ")] == list(NAMES)
    assert {*PUBLISHED, *FITTED} == set(NAMES)
    assert len(set(NAMES)) == len(EVERY)


def test_every_representation_starts_from_a_published_set_of_its_own_kind() -> None:
    for name in FITTED:
        start = named(start_of(name))
        assert start.grouping is None
        assert start.by_level == named(name).by_level
    assert [start_of(name) for name in PUBLISHED] == list(PUBLISHED)


def test_what_is_claimed_of_one_is_claimed_over_others_that_are_fitted() -> None:
    assert CONTESTS
    for better, worse in CONTESTS:
        assert better != worse
        assert {better, worse} <= set(FITTED)
    assert POOLED[0] in {better for better, _ in CONTESTS}


def test_no_other_file_of_the_kind_knows_a_representation_by_name() -> None:
    """But for what the paper says of its own two; ``literature`` is a stage and a source too."""
    names = "|".join(name for name in NAMES if name != "literature")
    knowing = {
        path.name: found
        for path in (*KIND.glob("*.py"), *KIND.glob("figures/*.py"))
        if (found := re.findall(rf"[\"'](?:{names})[\"']", path.read_text(encoding="utf-8")))
        and path.name not in {"representations.py", *OF_THE_PAPER}
    }
    assert not knowing


def test_the_documentation_has_a_line_of_each() -> None:
    told = (ROOT / "docs" / "studies" / "cohort_stiffness.md").read_text(encoding="utf-8")
    for name in NAMES:
        assert f"\n| `{name}` |" in told, name
