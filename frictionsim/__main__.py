"""Entry point of the command line; installs signal handlers before anything else is imported."""

import gc
import io
import os
import signal
import sys
from contextlib import suppress
from types import FrameType


def main() -> None:
    """Run the command line and exit with its code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # titles may not fit the terminal's encoding
    # The imports allocate hundreds of thousands of objects and free none; collecting garbage
    # would take longer than simulating a pulley.
    gc.disable()
    # pydantic would search all installed packages for plugins.
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"

    from frictionsim.cli.commands import run_command_line

    code = run_command_line(sys.argv[1:])
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # None if the parent process closed it
            with suppress(OSError):  # broken pipe or full disk
                stream.flush()
    os._exit(code)


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit at once on a signal; during a run, the run monitor handles signals instead."""
    os.write(2, b"frictionsim: interrupted\n")
    os._exit(128 + number)


if __name__ == "__main__":
    main()
