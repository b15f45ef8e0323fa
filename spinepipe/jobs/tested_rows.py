"""Rows of the table ``statistics`` from tests, corrected for how many were made."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from spinepipe.statistics import StatisticalTest, corrected, family_size


@dataclass(frozen=True)
class FamilyTest:
    """One test and what it is of; ``*`` stands for all specimens or joints together."""

    family: str
    joint: str
    response: str
    factor: str
    stratum: str
    outcome: StatisticalTest
    specimen: str = "*"


def corrected_rows(tests: Iterable[FamilyTest]) -> Iterator[dict[str, Any]]:
    """Rows with p-values corrected within each family and kind of test."""
    families: dict[tuple[str, str], list[FamilyTest]] = {}
    for test in tests:
        families.setdefault((test.family, test.outcome.test), []).append(test)
    for family in families.values():
        ps = [test.outcome.p for test in family]
        both = zip(family, corrected(ps, "bonferroni"), corrected(ps, "holm"), strict=True)
        for test, bonferroni, holm in both:
            yield _row(test, bonferroni, holm, family_size(ps))


def _row(
    test: FamilyTest, bonferroni: float | None, holm: float | None, size: int
) -> dict[str, Any]:
    outcome = test.outcome
    return {
        **{key: getattr(test, key) for key in ("specimen", "family", "joint", "response")},
        **{key: getattr(test, key) for key in ("factor", "stratum")},
        **{key: getattr(outcome, key) for key in ("test", "statistic_name", "statistic", "p", "n")},
        **{key: getattr(outcome, key) for key in ("effect_name", "effect", "message")},
        "status": outcome.status.value,
        "p_bonferroni": bonferroni,
        "p_holm": holm,
        "family_size": size,
    }
