"""Runs that stop at a step, and work that is killed, or told to stop, at a change of its files."""

import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import frictionsim as fs
from frictionsim.errors import BudgetExceeded, Interrupted

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.truncate", "os.chmod")


def interrupted_at(time: float) -> Callable[[float], None]:
    """Return an `on_step` that interrupts a run at a time, s."""

    def on_step(t: float) -> None:
        if t >= time:
            raise Interrupted(signal.SIGINT, t)

    return on_step


def spent(t: float) -> BudgetExceeded:
    return BudgetExceeded(f"stopped at t = {t} s")


def stopping(after: int, error: Callable[[float], Exception] = spent) -> Callable[[float], None]:
    """Return an `on_step` that stops a run after some calls."""
    calls = iter(range(after))

    def on_step(t: float) -> None:
        if next(calls, None) is None:
            raise error(t)

    return on_step


def calls_of(data: dict[str, Any]) -> list[float]:
    """Return the times at which a run calls its progress function, after its steps, s."""
    times: list[float] = []
    fs.solve(data, progress=times.append)
    return times


def stopped_at(
    change: int, work: Callable[[], int], folder: Path, number: int = signal.SIGKILL
) -> int:
    """Do work in a copy of this process, and send it a signal just before a change of its files.

    Changes are counted from 1: to open a file in the folder for writing, to wait until it is on
    the disk, to rename it, to remove it. Work with fewer changes ends by itself, as with 0.
    Returned is what the work returned, or minus the number of the signal that ended it.
    """
    child = os.fork()
    if child == 0:
        code = 70
        try:
            _send_at(change, folder, number)
            code = work()
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _send_at(change: int, folder: Path, number: int) -> None:
    """Send a signal to this process at a change; never undone."""
    seen = 0

    def count() -> None:
        nonlocal seen
        seen += 1
        if seen == change:
            os.kill(os.getpid(), number)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event in CHANGES or (event == "open" and (arguments[2] or 0) & WRITING):
            path = arguments[0]
            if not isinstance(path, int) and (Path.cwd() / os.fsdecode(path)).is_relative_to(
                folder
            ):
                count()

    sync = os.fsync

    def synced(descriptor: int) -> None:
        count()
        sync(descriptor)

    os.fsync = synced
    sys.addaudithook(hook)
