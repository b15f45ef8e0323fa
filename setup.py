"""Building a wheel: what lies beside the package in a clone goes inside it.

An installed spinepipe then has its workflow, profiles, examples and published numbers in
`spinepipe/beside` (see `spinepipe/shipped.py`), and Snakemake finds the plugin that speaks during a
run. An editable installation takes all that from the clone.
"""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

BESIDE = ("Snakefile", "requirements.lock", "config", "papers", "profiles", "workflow")
PLUGINS = Path("workflow") / "plugins"
PLUGIN = "snakemake_logger_plugin_spinepipe"


class WithWorkflow(build_py):
    """Adds the files to the folder that becomes the wheel."""

    def run(self) -> None:
        if self.editable_mode:
            return super().run()
        shutil.rmtree(self.build_lib, ignore_errors=True)  # what an earlier build left is no part
        super().run()
        into = Path(self.build_lib)
        _copy(PLUGINS / PLUGIN, into / PLUGIN)
        for name in BESIDE:
            _copy(Path(name), into / "spinepipe" / "beside" / name)


def _copy(place: Path, to: Path) -> None:
    """A file, or a folder without what Python compiles, hidden files and the plugins."""
    to.parent.mkdir(parents=True, exist_ok=True)
    if place.is_file():
        shutil.copy2(place, to)
    else:
        left_out = shutil.ignore_patterns("__pycache__", ".*", PLUGINS.name)
        shutil.copytree(place, to, ignore=left_out)


setup(cmdclass={"build_py": WithWorkflow})
