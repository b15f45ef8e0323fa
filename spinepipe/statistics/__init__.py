"""Statistics: tests of arrays, each with statistic, p, effect size, status and message."""

from spinepipe.statistics.agreement import Agreement, bland_altman
from spinepipe.statistics.correction import corrected, family_size
from spinepipe.statistics.correlation import kendall, spearman
from spinepipe.statistics.kruskal import critical_h, kruskal_wallis
from spinepipe.statistics.mean import Mean, mean_of
from spinepipe.statistics.nested import f_test_nested
from spinepipe.statistics.normality import (
    chi_squared_normality,
    kolmogorov_smirnov_normality,
    lilliefors_normality,
)
from spinepipe.statistics.outcome import Ended, Outcome
from spinepipe.statistics.ranks import friedman
from spinepipe.statistics.signed_rank import wilcoxon_signed_rank

__all__ = [
    "Agreement",
    "Ended",
    "Mean",
    "Outcome",
    "bland_altman",
    "chi_squared_normality",
    "corrected",
    "critical_h",
    "f_test_nested",
    "family_size",
    "friedman",
    "kendall",
    "kolmogorov_smirnov_normality",
    "kruskal_wallis",
    "lilliefors_normality",
    "mean_of",
    "spearman",
    "wilcoxon_signed_rank",
]
