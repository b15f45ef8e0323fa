"""Every kind of result file carries its mark and gives it back; other files have none.

Catches a file without its mark, and a damaged one that is believed.
"""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from drawn import a_picture
from matplotlib.image import imread
from sweeps import sweep

from spinepipe.marks import KEY, marked, read_mark, with_mark, without_mark, write_marked
from spinepipe.model.file import EffectEntry, ModelFile, read_model, write_model
from spinepipe.motion.export import mot
from spinepipe.studies.joint_pose_sensitivity.tables import AGREEMENT
from spinepipe.tables import from_rows, write

DIGEST, OTHER = "0123456789abcdef" * 4, "f" * 64


def save(suffix: str, path: Path, digest: str) -> None:
    """A file of that kind, as the jobs write it."""
    if suffix == ".parquet":
        write(from_rows(AGREEMENT, []), path, {KEY: digest} if digest else {})
    elif suffix == ".json":
        data = {"a": [1, {"b": "c"}]}
        path.write_text(json.dumps(with_mark(data, digest) if digest else data, indent=1) + "\n")
    elif suffix == ".yaml":
        write_model(MODEL, path, digest)
    elif suffix in (".svg", ".png", ".pdf"):
        write_marked(a_picture(suffix[1:]), path, digest)
    elif suffix == ".mot":
        write_marked(mot("m", np.zeros(3), np.zeros((3, 18, 6))), path, digest)
    else:
        write_marked("<html><body>text</body></html>", path, digest)


MODEL = ModelFile(model="m", cohort="c", effects=(EffectEntry(effect="linear_bushing"),))
KINDS = (".parquet", ".json", ".yaml", ".svg", ".png", ".pdf", ".html", ".osim", ".mot")


@sweep("suffix", KINDS)
def test_a_mark_comes_back_from_every_kind_of_file(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"file{suffix}"
    for digest in (DIGEST, OTHER, ""):
        save(suffix, path, digest)
        assert read_mark(path) == digest


@sweep("suffix", KINDS)
def test_one_changed_byte_of_a_mark_is_seen(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"file{suffix}"
    save(suffix, path, DIGEST)
    raw = path.read_bytes()
    at = raw.rindex(DIGEST.encode())
    path.write_bytes(raw[:at] + b"9" + raw[at + 1 :])
    assert read_mark(path) != DIGEST


@sweep("suffix", KINDS)
def test_half_a_file_or_none_of_its_kind_has_no_mark(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"file{suffix}"
    save(suffix, path, DIGEST)
    path.write_bytes(path.read_bytes()[:-90])
    assert read_mark(path) == ""
    path.write_bytes(b"")
    assert read_mark(path) == ""


def test_files_with_a_mark_read_as_without(tmp_path: Path) -> None:
    write_model(MODEL, tmp_path / "model.yaml", DIGEST)
    assert read_model(tmp_path / "model.yaml") == MODEL
    plain = a_picture("png")
    assert (imread(io.BytesIO(marked(plain, ".png", DIGEST))) == imread(io.BytesIO(plain))).all()
    assert without_mark(with_mark({"s01": 1}, DIGEST)) == {"s01": 1}


def test_the_mark_of_an_embedded_file_is_not_that_of_the_page(tmp_path: Path) -> None:
    inner = marked("<svg/>", ".svg", OTHER).decode()
    write_marked(f"<html>{inner}</html>", tmp_path / "page.html", DIGEST)
    assert read_mark(tmp_path / "page.html") == DIGEST
    write_marked(f"<html>{inner}</html>", tmp_path / "page.html", "")
    assert read_mark(tmp_path / "page.html") == ""


def test_a_kind_of_file_that_carries_no_mark_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"a file \.txt carries no mark"):
        write_marked("text", tmp_path / "file.txt", DIGEST)
    assert not list(tmp_path.iterdir())
