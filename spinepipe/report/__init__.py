"""Report: figures and pages from result tables."""
