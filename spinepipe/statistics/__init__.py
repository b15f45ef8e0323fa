"""Statistics: tests of arrays, each with statistic, p, effect size, status and message."""

from spinepipe.statistics.agreement import Agreement, bland_altman
from spinepipe.statistics.correlation import kendall, spearman
from spinepipe.statistics.normality import (
    chi_squared_normality,
    f_test_nested,
    kolmogorov_smirnov_normality,
    lilliefors_normality,
)
from spinepipe.statistics.outcome import (
    ComputationStatus,
    Mean,
    StatisticalTest,
    corrected,
    family_size,
    mean_of,
)
from spinepipe.statistics.rank_tests import (
    critical_h,
    friedman,
    kruskal_wallis,
    wilcoxon_signed_rank,
)

__all__ = [
    "Agreement",
    "ComputationStatus",
    "Mean",
    "StatisticalTest",
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
