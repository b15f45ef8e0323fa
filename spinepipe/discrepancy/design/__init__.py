"""What a cohort's tests could tell of each effect, before residuals are looked at."""
