"""The table of conclusions, which every study has; its columns stand in tables.csv."""

from spinepipe.schema import declared

CONCLUSIONS = declared(__file__, "conclusions")
