"""Published reference values, one TOML file per paper, each number with its table or section."""

from spinepipe.anatomy.published import PAPERS, published

__all__ = ["PAPERS", "published"]
