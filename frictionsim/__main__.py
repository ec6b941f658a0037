"""Entry point of the command line; sets up signals and streams before anything else is imported."""

import gc
import io
import os
import signal
import sys
from contextlib import suppress

STANDARD_STREAMS = (0, 1, 2)


def main() -> None:
    """Run the command line and exit with its code."""
    _restore_default_of_sigint()
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # titles may not fit the terminal's encoding
    # The imports allocate hundreds of thousands of objects and free none; collecting garbage
    # would take longer than simulating a pulley.
    gc.disable()
    # Pictures are files here, and a notebook may say what it shows its own with.
    os.environ["MPLBACKEND"] = "agg"
    # pydantic would search all installed packages for plugins.
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"
    # To start a thread for each core takes a tenth of the start-up; no matrix here is large.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from frictionsim.cli.commands import run_command_line

    code = run_command_line(sys.argv[1:])
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # None if the parent process closed it
            with suppress(OSError, ValueError):  # broken pipe or full disk; closed
                stream.flush()
    os._exit(code)


def _restore_default_of_sigint() -> None:
    """Have Ctrl-C end the process at once, as SIGTERM and SIGHUP do.

    A handler in Python does not run while code in C does: a library that computes or waits would
    be deaf to it. Only around the steps of a run, which leave something to keep, signals are
    handled (`cli.terminal`). The process then dies of the signal itself: shells see 130, 143 or
    129, and a loop of bash ends with the command that Ctrl-C ended. What the parent process has
    set to be ignored, as nohup does, stays ignored.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _open_closed_streams() -> None:
    """Open the null device in the place of closed standard streams.

    The next file that is opened would else have the number of stdout or stderr, and what C code
    prints would be written into a result.
    """
    with suppress(OSError):  # there is no such device, as in a bare chroot
        while (descriptor := os.open(os.devnull, os.O_RDWR)) in STANDARD_STREAMS:
            os.set_inheritable(descriptor, True)
        os.close(descriptor)
        # Of stdin None is left: "the standard input is closed" is said where it is to be read.
        for name in ("stdout", "stderr"):
            if getattr(sys, name) is None:
                setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115


if __name__ == "__main__":
    main()
