"""Run the command line as on a system that is not POSIX.

    python -X warn_default_encoding windows_like.py ARGUMENTS
    python -X warn_default_encoding windows_like.py + "ARGUMENTS"...   several, one after the other

What Windows lacks is taken away, and what it refuses is refused, before anything is imported from
the package. The libraries that the package uses still see the system that they were made for; so
only those calls are taken away that none of them needs. To open a file as text without an encoding,
which is not UTF-8 there, is an error in the package.
"""

import os
import shlex
import shutil
import signal
import socket
import stat
import sys
import warnings
from pathlib import Path
from typing import Any

MISSING_MODULES = ("resource", "fcntl", "pwd", "grp", "termios", "tty", "pty", "syslog")
MISSING = {
    os: (
        *("getuid", "geteuid", "getgid", "getegid", "getgroups", "getpgid", "getpgrp", "getsid"),
        *("set_blocking", "fchmod", "fchown", "chown", "lchown", "fdatasync", "sync", "nice"),
        *("fork", "killpg", "setsid", "setuid", "setgid", "wait", "mkfifo", "statvfs"),
        *("getloadavg",),
        *("sysconf", "confstr", "sched_getaffinity", "sendfile", "pread", "pwrite"),
    ),
    signal: (
        *("SIGHUP", "SIGQUIT", "SIGPIPE", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGCHLD"),
        *("SIGCONT", "SIGSTOP", "SIGTSTP", "SIGWINCH", "alarm", "setitimer", "pause", "sigwait"),
        *("pthread_kill", "pthread_sigmask", "siginterrupt"),
    ),
    socket: ("AF_UNIX",),
}
SIGNALS = ("SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM")


def take_away() -> None:
    """Remove modules and functions of POSIX, and refuse what Windows refuses."""
    for module in MISSING_MODULES:
        sys.modules[module] = None  # type: ignore[assignment]  # an import of it fails
    _pair_of_sockets()
    _space_on_disks()
    for owner, names in MISSING.items():
        for name in names:
            if hasattr(owner, name):
                delattr(owner, name)
    _refuse(os, "open", _is_folder, PermissionError(13, "Permission denied"))
    _refuse(os, "fsync", _is_folder, OSError(9, "Bad file descriptor"))
    allowed = {getattr(signal, name) for name in SIGNALS}
    _refuse(signal, "signal", lambda number: number not in allowed, ValueError("invalid signal"))
    _refuse(signal, "set_wakeup_fd", _is_no_socket, ValueError("not a socket"))


def _refuse(owner: Any, name: str, refused: Any, error: Exception) -> None:
    """Have a function raise an error where its first argument is refused."""
    function = getattr(owner, name)

    def refusing(first: Any, *others: Any, **named: Any) -> Any:
        if refused(first):
            raise error
        return function(first, *others, **named)

    setattr(owner, name, refusing)


def _is_folder(path: Any) -> bool:
    try:
        return stat.S_ISDIR(os.stat(path).st_mode)
    except OSError:
        return False


def _is_no_socket(descriptor: int) -> bool:
    return descriptor != -1 and not stat.S_ISSOCK(os.fstat(descriptor).st_mode)


def _pair_of_sockets() -> None:
    """Make pairs of sockets as Windows does, by way of the network of this machine."""

    def socketpair() -> tuple[socket.socket, socket.socket]:
        with socket.create_server(("127.0.0.1", 0)) as server:
            near = socket.create_connection(server.getsockname())
            far, _ = server.accept()
            return near, far

    socket.socketpair = socketpair  # type: ignore[assignment]


def _space_on_disks() -> None:
    """Ask for the space on a disk without `statvfs`, as `shutil` does on Windows."""
    usage = shutil.disk_usage(".")
    shutil.disk_usage = lambda path: usage  # type: ignore[assignment]


if __name__ == "__main__":
    import platformdirs.unix  # noqa: F401  # made for this system; there it takes another part

    assert sys.flags.warn_default_encoding
    warnings.simplefilter("ignore", category=EncodingWarning)
    warnings.filterwarnings("error", category=EncodingWarning, module="frictionsim")
    take_away()
    sys.path.insert(0, str(Path(__file__).parents[2]))
    sys.argv[0] = "frictionsim"
    if sys.argv[1] == "+":
        from frictionsim.cli.commands import run_command_line

        for command in sys.argv[2:]:
            code = run_command_line(["--debug", *shlex.split(command)])
            print(f"+ exit code {code}", flush=True)
    else:
        from frictionsim.__main__ import main

        sys.argv.insert(1, "--debug")
        main()
