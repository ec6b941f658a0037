"""The entry of the command line, kept apart so that it can answer before anything is loaded."""

import gc
import os
import sys
from contextlib import suppress


def main() -> None:
    """Run the command line and leave with its exit code."""
    # A short run allocates hundreds of thousands of objects while it imports and frees none:
    # collecting them, now or at the end, takes longer than to simulate a pulley.
    gc.disable()
    # pydantic would look through all installed packages for plugins of its own.
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"

    from frictionsim.cli import run_command_line

    code = run_command_line(sys.argv[1:])
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # closed by who started this
            with suppress(OSError):  # its reader has left, or its disk is full
                stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
