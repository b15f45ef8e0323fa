"""Snakemake is used by what its documentation and plug-in interfaces offer.

Catches a private name of Snakemake that is read, assigned or subclassed: each of its releases would
be a port.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

IMPORTED = {
    "snakemake.utils",
    "snakemake_interface_logger_plugins.base",
    "snakemake_interface_logger_plugins.common",
    "snakemake_logger_plugin_spinepipe.time_left",
}
"""Modules that rules, plug-in and library may import: documented, an interface, or our own."""

WORKFLOW = {"basedir", "cores"}
"""What is documented of the object `workflow`."""

RULES = {"output", "input", "params", "log"}
"""What is documented of a rule that others refer to."""


def sources() -> list[Path]:
    folders = (ROOT / "workflow").rglob("*.smk"), (ROOT / "workflow").rglob("*.py")
    return [ROOT / "Snakefile", *(ROOT / "spinepipe").rglob("*.py"), *folders[0], *folders[1]]


def test_no_private_name_of_snakemake_is_used() -> None:
    looked_at = 0
    for path in sources():
        text = path.read_text("utf-8")
        imported = re.findall(r"^\s*(?:from|import) (snakemake[\w.]*)", text, re.MULTILINE)
        assert set(imported) <= IMPORTED, path
        looked_at += len(imported)
        if path.suffix == ".smk" or path.name == "Snakefile":
            assert set(re.findall(r"\bworkflow\.(\w+)", strings_left_out(text))) <= WORKFLOW, path
            assert set(re.findall(r"\brules\.\w+\.(\w+)", text)) <= RULES, path
            assert not re.findall(r"\bcheckpoints\b|\b_\w+\b\s*=", text), path
    assert looked_at >= 3


def strings_left_out(text: str) -> str:
    """Text without what stands in quotes: names of folders."""
    return re.sub(r"\"[^\"\n]*\"", '""', text)
