"""YAML files of cohorts and studies: read within bounds and held against their settings."""

from spinepipe.documents.settings import validate
from spinepipe.documents.yaml_text import Document, read_yaml

__all__ = ["Document", "read_yaml", "validate"]
