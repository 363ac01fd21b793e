"""The command as a process of its own: `lobefem`, or `python -m lobefem`.

What is set here for the whole process comes before the imports, of which there are many.
"""

from __future__ import annotations

import gc
import os
import signal
import sys

__all__ = ["main"]


def main() -> int:
    """Run the command that this process was started for; returns its exit code."""
    # until the command takes it over, Ctrl-C ends the process without Python's traceback
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # what is imported lives to the end: looking for garbage in it takes a quarter of a second
    gc.disable()
    # typer is built on pydantic, which looks for plugins in the metadata of all packages there are
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # small matrices by the thousand: threads of BLAS would only wait for each other
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from lobefem.app import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
