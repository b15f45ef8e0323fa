"""A real Slurm of one node, this machine, that lives in a folder and ends with the test.

It needs the programs of the distribution (Debian: slurmctld, slurmd, munge), and to be root, as
slurmd starts jobs in the name of users. There is no accounting:
the queue itself tells how jobs are.
"""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "squeue", "sinfo", "scontrol")

_CONFIG = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SlurmdParameters=config_overrides
ReturnToService=2
SchedulerParameters=sched_interval=2
MinJobAge=3600
KillWait=2
OverTimeLimit=0
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=64000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime={minutes} State=UP
"""


def why_not() -> str:
    """Why no Slurm can be started here; empty where it can."""
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        return f"not installed: {', '.join(missing)}"
    return "" if os.geteuid() == 0 else "slurmd starts jobs as root alone"


@contextmanager
def running(folder: Path, minutes: int) -> Iterator[dict[str, str]]:
    """Start it; environment variables with which its programs find it.

    Parameters
    ----------
    folder : with a short path: sockets have at most 107 characters. minutes : most of a job.
    """
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    host, ports = socket.gethostname().split(".")[0], []
    for _ in range(2):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            ports.append(free.getsockname()[1])
    config = folder / "slurm.conf"
    config.write_text(_CONFIG.format(host=host, ports=ports, folder=folder, minutes=minutes))
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    # jobs are submitted without variables of Slurm: its programs find this one by the path
    (folder / "bin").mkdir()
    srun = folder / "bin/srun"
    srun.write_text(f'#!/bin/sh\nSLURM_CONF={config} exec {shutil.which("srun")} "$@"\n')
    srun.chmod(0o755)
    path = f"{folder}/bin:{os.environ['PATH']}"
    environment = {**os.environ, "SLURM_CONF": str(config), "PATH": path}
    of_munge = (f"--{one}-file={folder}/munge.{one}" for one in ("key", "pid", "log", "seed"))
    commands = (
        ["munged", "--foreground", "--force", f"--socket={folder}/munge.socket", *of_munge],
        ["slurmctld", "-D", "-c"],
        ["slurmd", "-D", "-N", host],
    )
    started = []
    try:
        for command in commands:
            with (folder / f"{command[0]}.out").open("wb") as log:
                started.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log))
            time.sleep(1)
        asked = ["sinfo", "--noheader", "--format=%T"]
        for _ in range(60):
            told = subprocess.run(asked, env=environment, capture_output=True, text=True).stdout
            if told.strip() == "idle":
                break
            time.sleep(1)
        else:
            logs = (path.read_text(errors="replace")[-2000:] for path in folder.glob("slurm*.log"))
            raise RuntimeError(f"the node is {told!r}\n" + "\n".join(logs))
        yield environment
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait()
