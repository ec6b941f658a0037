"""The entry of the command line, kept apart so that it can answer before anything is loaded."""

import gc
import io
import os
import signal
import sys
from contextlib import suppress
from types import FrameType


def main() -> None:
    """Run the command line and leave with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a title in letters that the terminal lacks
    # A short run allocates hundreds of thousands of objects while it imports and frees none:
    # collecting them, now or at the end, takes longer than to simulate a pulley.
    gc.disable()
    # pydantic would look through all installed packages for plugins of its own.
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"

    from frictionsim.cli.commands import run_command_line

    code = run_command_line(sys.argv[1:])
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # closed by who started this
            with suppress(OSError):  # its reader has left, or its disk is full
                stream.flush()
    os._exit(code)


def _leave(number: int, frame: FrameType | None) -> None:
    """Leave at once on a signal; while a scenario is simulated it is another's to handle."""
    os.write(2, b"frictionsim: interrupted\n")
    os._exit(128 + number)


if __name__ == "__main__":
    main()
