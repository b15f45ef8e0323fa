"""`python -m tests.kernels`: the tests marked `numeric` under every kernel this processor can run.

OpenBLAS chooses its kernel by the processor, and results differ by it in rounding; numpy and scipy
bring an OpenBLAS each. `OPENBLAS_CORETYPE` chooses another; a name that the library does not know
is ignored by it, and one that the processor cannot run ends in an illegal instruction. So flags are
asked first, and what took effect afterwards. `--one` asks for a kernel beside the newest that
the processor can run, under which `make test` has run, and leaves out tests marked `slow` or
`full`; all other options are pytest's.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

KERNELS: Mapping[str, frozenset[str]] = {
    "SkylakeX": frozenset(
        {"avx2", "fma", "avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"}
    ),
    "Haswell": frozenset({"avx2", "fma"}),
    "Sandybridge": frozenset({"avx"}),
    "Nehalem": frozenset({"sse4_2"}),
}
"""Kernels of the OpenBLAS in the wheels of numpy and scipy, newest first, and the flags they need.

Processors by AMD use Haswell (from Zen on) or older ones, newer ones by Intel SkylakeX."""

ASKS = (
    "import json, scipy.linalg, threadpoolctl; print(json.dumps(["
    "one['architecture'] for one in threadpoolctl.threadpool_info()"
    " if one['internal_api'] == 'openblas']))"
)


def flags(cpuinfo: str) -> frozenset[str]:
    """The flags of the first processor of a `/proc/cpuinfo`; none where it lists none."""
    for line in cpuinfo.splitlines():
        name, _, words = line.partition(":")
        if name.strip() == "flags":
            return frozenset(words.split())
    return frozenset()


def runnable(there: frozenset[str]) -> dict[str, bool]:
    """Whether a processor with these flags can run each kernel."""
    return {kernel: needed <= there for kernel, needed in KERNELS.items()}


def environment(kernel: str) -> dict[str, str]:
    """Of a process that is to use a kernel, with one thread."""
    single = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return {**os.environ, **single, "OPENBLAS_CORETYPE": kernel}


def in_effect(kernel: str) -> list[str]:
    """The kernels that numpy and scipy use when told to use this one."""
    asked = subprocess.run(
        [sys.executable, "-c", ASKS],
        env=environment(kernel),
        capture_output=True,
        text=True,
        check=True,
    )
    return list(json.loads(asked.stdout))


def marked() -> list[str]:
    """Files in which a test bears the mark: to load all others takes longer than to run these."""
    every = sorted(Path("tests").rglob("test_*.py"))
    return [str(path) for path in every if "pytest.mark.numeric" in path.read_text()]


def main(options: list[str]) -> int:
    """Run them, telling which could not be run; 1 if a test failed or a kernel did not act."""
    source = Path("/proc/cpuinfo")
    if platform.machine() not in ("x86_64", "AMD64") or not source.exists():
        print(f"no kernels are known for {platform.system()} on {platform.machine()}: none run")
        return 0
    kernels = runnable(flags(source.read_text()))
    numeric = "numeric"
    if options[:1] == ["--one"]:
        options, numeric = options[1:], "numeric and not slow and not full"
        kernels = dict([one for one in kernels.items() if one[1]][1:2])
        if not kernels:
            print("this processor can run no further kernel")
    failed = []
    for kernel, can in kernels.items():
        if not can:
            print(f"{kernel}: not run, this processor cannot", flush=True)
            continue
        found = in_effect(kernel)
        if not found or set(found) != {kernel}:
            print(f"{kernel}: asked for, but {found or 'no OpenBLAS'} is used", flush=True)
            failed.append(kernel)
            continue
        print(f"{kernel}: tests marked numeric", flush=True)
        tests = [
            sys.executable,
            "-m",
            "pytest",
            "-m",
            numeric,
            *marked(),
            *options,
        ]
        if subprocess.run(tests, env=environment(kernel), check=False).returncode != 0:
            failed.append(kernel)
    print("failed: " + ", ".join(failed) if failed else "no kernel failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
