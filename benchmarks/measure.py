"""Run one process and print its time and memory as JSON: measure.py, a job as JSON on stdin.

A process of its own, with nothing imported: what a child inherits of its parent's memory counts as the
child's peak.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from typing import Any


def run(
    command: list[str], folder: str, environment: dict[str, str], stdin: str, limit: float
) -> dict[str, Any]:
    """Run a command to its end, stdout and stderr in files of its folder.

    Args:
        command: what to run.
        folder: where.
        environment: all of it.
        stdin: what it reads.
        limit: seconds after which it is ended, with its children.

    Returns:
        seconds, CPU seconds, peak memory of the largest of its processes [MB], exit code (None if ended).
    """
    late = False

    def end(*_: object) -> None:
        nonlocal late
        late = True
        os.killpg(process.pid, signal.SIGKILL)

    names = [os.path.join(folder, name) for name in ("stdin", "stdout", "stderr")]
    with open(names[0], "w+") as given, open(names[1], "w") as out, open(names[2], "w") as error:
        given.write(stdin)
        given.seek(0)
        start = time.perf_counter()
        process = subprocess.Popen(
            command,
            stdin=given,
            stdout=out,
            stderr=error,
            cwd=folder,
            env=environment,
            start_new_session=True,
        )
        signal.signal(signal.SIGALRM, end)
        signal.setitimer(signal.ITIMER_REAL, limit)
        _, status, usage = os.wait4(process.pid, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        seconds = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    return {
        "seconds": seconds,
        "cpu": usage.ru_utime + usage.ru_stime,
        "memory": usage.ru_maxrss / 1024,
        "code": None if late else process.returncode,
    }


if __name__ == "__main__":
    print(json.dumps(run(**json.load(sys.stdin))))
