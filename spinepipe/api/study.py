"""A study that no file holds: the arguments of a call, checked as a study file is."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from spinepipe.cohort import Cohort
from spinepipe.model.file import ModelFile, write_model
from spinepipe.studies.read import of_data
from spinepipe.studies.study import Study

NAME = "notebook"
"""Of the study, where tables and models name one."""

Say = Callable[[str], None]
"""Given a line now and then, such as `print`."""

AnyStudy = TypeVar("AnyStudy", bound=Study)


def study_of(kind: type[AnyStudy], cohort: Cohort, asked: Mapping[str, Any]) -> AnyStudy:
    """The study with these settings, and the default of every other.

    Parameters
    ----------
    asked : keys as in a study file; those that are None are left to their defaults.

    Raises
    ------
    InputError
        With all that is wrong with settings and cohort, as `spinepipe check` would tell it.
    """
    name = kind.model_fields["kind"].annotation.__args__[0]  # type: ignore[union-attr]
    given = {key: value for key, value in asked.items() if value is not None}
    data = {"study": NAME, "kind": name, "cohort": cohort.name, **given}
    study = of_data(data, cohort, f"{name} from a notebook")
    assert isinstance(study, kind)
    return study


@contextmanager
def model_path(model: ModelFile | str | Path | None) -> Iterator[str | None]:
    """Where a model lies as a file while it is used; None for none."""
    if not isinstance(model, ModelFile):
        yield None if model is None else str(Path(model).absolute())
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        write_model(model, path)
        yield str(path)
