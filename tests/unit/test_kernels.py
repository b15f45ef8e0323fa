"""Which kernels of OpenBLAS a processor can run, and that one that is asked for acts.

Catches numeric tests that ran under another kernel than was asked for, or under none.
"""

import subprocess
from pathlib import Path

import pytest

from tests import kernels

AVX2 = "processor\t: 0\nflags\t\t: fpu sse4_2 avx avx2 fma\n\nprocessor\t: 1\nflags\t: fpu\n"
AVX512 = AVX2.replace("fma", "fma avx512f avx512dq avx512cd avx512bw avx512vl")

REAL_FLAGS = kernels.flags


@pytest.mark.parametrize(
    ("cpuinfo", "expected"),
    [
        (AVX512, ["SkylakeX", "Haswell", "Sandybridge", "Nehalem"]),
        (AVX512.replace(" avx512vl", ""), ["Haswell", "Sandybridge", "Nehalem"]),
        (AVX2, ["Haswell", "Sandybridge", "Nehalem"]),
        (AVX2.replace(" fma", ""), ["Sandybridge", "Nehalem"]),
        ("flags: sse4_2", ["Nehalem"]),
        ("Features: asimd", []),
        ("", []),
    ],
)
def test_a_processor_runs_the_kernels_whose_flags_it_has(cpuinfo: str, expected: list[str]) -> None:
    can = kernels.runnable(kernels.flags(cpuinfo))
    assert [kernel for kernel, yes in can.items() if yes] == expected


def of_this_machine() -> list[str]:
    source = Path("/proc/cpuinfo")
    there = kernels.flags(source.read_text()) if source.exists() else frozenset()
    return [kernel for kernel, yes in kernels.runnable(there).items() if yes]


@pytest.mark.parametrize("kernel", of_this_machine())
def test_a_kernel_that_is_asked_for_acts_in_numpy_and_in_scipy(kernel: str) -> None:
    assert kernels.in_effect(kernel) == [kernel, kernel]


def test_what_was_not_run_is_said_and_what_failed_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of four kernels one cannot be run, one does not act, one fails its tests."""

    def run(command: list[str], env: dict[str, str], check: bool) -> object:
        return subprocess.CompletedProcess(command, int(env["OPENBLAS_CORETYPE"] == "Nehalem"))

    acting = {"Haswell": "Nehalem", "Sandybridge": "Sandybridge", "Nehalem": "Nehalem"}
    monkeypatch.setattr(kernels.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(kernels, "flags", lambda _: frozenset(AVX2.split()))
    monkeypatch.setattr(kernels, "in_effect", lambda kernel: [acting[kernel]] * 2)
    monkeypatch.setattr(kernels.subprocess, "run", run)
    assert kernels.main([]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "SkylakeX: not run, this processor cannot",
        "Haswell: asked for, but ['Nehalem', 'Nehalem'] is used",
        "Sandybridge: tests marked numeric",
        "Nehalem: tests marked numeric",
        "failed: Haswell, Nehalem",
    ]


def test_one_is_the_next_after_the_processors_own(monkeypatch: pytest.MonkeyPatch) -> None:
    ran = []

    def run(command: list[str], env: dict[str, str], check: bool) -> object:
        ran.append(
            (
                env["OPENBLAS_CORETYPE"],
                "numeric and not slow and not full" in command,
                "-x" in command,
            )
        )
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(kernels.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(kernels, "in_effect", lambda kernel: [kernel] * 2)
    monkeypatch.setattr(kernels.subprocess, "run", run)
    for there in (AVX512, AVX2, "flags: sse4_2"):
        monkeypatch.setattr(kernels, "flags", lambda _, there=there: REAL_FLAGS(there))
        assert kernels.main(["--one", "-x"]) == 0
    assert ran == [("Haswell", True, True), ("Sandybridge", True, True)]


def test_other_processors_run_none_and_it_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(kernels.platform, "machine", lambda: "aarch64")
    assert kernels.main([]) == 0
    assert "none run" in capsys.readouterr().out
